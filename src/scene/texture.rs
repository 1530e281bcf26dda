//! Images and how they are looked up.

use std::sync::OnceLock;

use glam::{Vec2, Vec4};

/// What a texture does outside 0…1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every second one mirrored.
    Mirror,
    /// The border goes on.
    Clamp,
}

/// How a magnified texture is looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// Bilinear.
    #[default]
    Linear,
}

/// Texels, row-major, row 0 on top.
#[derive(Clone, Debug)]
pub enum Pixels {
    /// 8 bits a channel.
    Rgba8(Vec<[u8; 4]>),
    /// 16 bits a channel.
    Rgba16(Vec<[u16; 4]>),
}

/// A decoded image. Whether its colours are sRGB-encoded is for whoever looks it up to say, by the
/// last argument of [`Texture::sample`].
#[derive(Clone, Debug)]
pub struct Image {
    /// Its name or file name.
    pub name: String,
    /// Texels to the right.
    pub width: u32,
    /// Texels downwards.
    pub height: u32,
    /// `width · height` texels.
    pub pixels: Pixels,
}

/// An image with its sampler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// Index of the image.
    pub image: u32,
    /// Wrapping along u and v.
    pub wrap: [Wrap; 2],
    /// Magnification filter.
    pub filter: Filter,
}

/// `uv' = M·uv + t`: KHR_texture_transform and MTL's `-s` and `-o`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    /// Columns of M.
    pub x_axis: Vec2,
    /// Columns of M.
    pub y_axis: Vec2,
    /// t.
    pub offset: Vec2,
}

impl UvTransform {
    /// Coordinates as they are.
    pub const IDENTITY: UvTransform = UvTransform { x_axis: Vec2::X, y_axis: Vec2::Y, offset: Vec2::ZERO };

    /// KHR_texture_transform: scale, then rotate by `rotation` radians (counter-clockwise in the
    /// image, so clockwise in uv), then offset.
    pub fn khr(offset: Vec2, rotation: f32, scale: Vec2) -> UvTransform {
        let (s, c) = (libm::sinf(rotation), libm::cosf(rotation));
        UvTransform { x_axis: Vec2::new(c, -s) * scale.x, y_axis: Vec2::new(s, c) * scale.y, offset }
    }

    /// Applies it.
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        self.x_axis * uv.x + self.y_axis * uv.y + self.offset
    }
}

/// A material's use of a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index of the texture.
    pub texture: u32,
    /// Which set of texture coordinates.
    pub uv_set: u32,
    /// Applied to the coordinates first.
    pub transform: UvTransform,
}

impl Wrap {
    /// The texel that `i` of `n` stands for.
    fn texel(self, i: i64, n: i64) -> usize {
        let i = match self {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Clamp => i.clamp(0, n - 1),
            Wrap::Mirror => {
                let i = i.rem_euclid(2 * n);
                if i < n { i } else { 2 * n - 1 - i }
            }
        };
        i as usize
    }

    /// Brings a coordinate near 0…1 where that changes nothing, so that large ones keep their
    /// fraction and infinite ones do no harm.
    fn fold(self, x: f32) -> f64 {
        let x = f64::from(x);
        if !x.is_finite() {
            return 0.0;
        }
        match self {
            Wrap::Repeat => x - x.floor(),
            Wrap::Mirror => x - 2.0 * (0.5 * x).floor(),
            Wrap::Clamp => x.clamp(-1.0, 2.0),
        }
    }
}

impl Image {
    fn texel(&self, x: usize, y: usize, srgb: bool) -> Vec4 {
        let i = y * self.width as usize + x;
        match &self.pixels {
            Pixels::Rgba8(p) => {
                let [r, g, b, a] = p[i];
                let table = if srgb { srgb_table() } else { linear_table() };
                let at = |v: u8| table[usize::from(v)];
                Vec4::new(at(r), at(g), at(b), f32::from(a) / 255.0)
            }
            Pixels::Rgba16(p) => {
                let [r, g, b, a] = p[i].map(|v| f32::from(v) / 65535.0);
                if srgb {
                    Vec4::new(srgb_to_linear(r), srgb_to_linear(g), srgb_to_linear(b), a)
                } else {
                    Vec4::new(r, g, b, a)
                }
            }
        }
    }
}

impl Texture {
    /// The texture's value at `uv` at its finest level, colours decoded from sRGB first where
    /// `srgb` says so; alpha is linear always.
    pub fn sample(&self, images: &[Image], uv: Vec2, srgb: bool) -> Vec4 {
        let image = &images[self.image as usize];
        let (w, h) = (i64::from(image.width), i64::from(image.height));
        let [wu, wv] = self.wrap;
        let (x, y) = (wu.fold(uv.x) * w as f64, wv.fold(uv.y) * h as f64);
        if self.filter == Filter::Nearest {
            return image.texel(wu.texel(x.floor() as i64, w), wv.texel(y.floor() as i64, h), srgb);
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = ((x - x0) as f32, (y - y0) as f32);
        let (x0, y0) = (x0 as i64, y0 as i64);
        let (xa, xb) = (wu.texel(x0, w), wu.texel(x0 + 1, w));
        let (ya, yb) = (wv.texel(y0, h), wv.texel(y0 + 1, h));
        let top = image.texel(xa, ya, srgb) * (1.0 - fx) + image.texel(xb, ya, srgb) * fx;
        let bottom = image.texel(xa, yb, srgb) * (1.0 - fx) + image.texel(xb, yb, srgb) * fx;
        top * (1.0 - fy) + bottom * fy
    }
}

/// IEC 61966-2-1: an encoded value in 0…1 to linear light.
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

fn srgb_table() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)))
}

fn linear_table() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|i| i as f32 / 255.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> [Image; 1] {
        let pixels = Pixels::Rgba8(vec![[0; 4], [255; 4]]);
        [Image { name: "ramp".into(), width: 2, height: 1, pixels }]
    }

    fn at(wrap: Wrap, filter: Filter, u: f32) -> f32 {
        let texture = Texture { image: 0, wrap: [wrap; 2], filter };
        texture.sample(&ramp(), Vec2::new(u, 0.5), false).x
    }

    #[test]
    fn texels_are_hit_at_their_centres() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            assert_eq!((at(wrap, Filter::Linear, 0.25), at(wrap, Filter::Linear, 0.75)), (0.0, 1.0));
            assert_eq!(at(wrap, Filter::Linear, 0.5), 0.5);
            assert_eq!((at(wrap, Filter::Nearest, 0.49), at(wrap, Filter::Nearest, 0.51)), (0.0, 1.0));
        }
    }

    #[test]
    fn wrapping_outside() {
        assert_eq!(at(Wrap::Repeat, Filter::Nearest, 1.25), 0.0);
        assert_eq!(at(Wrap::Mirror, Filter::Nearest, 1.25), 1.0);
        assert_eq!(at(Wrap::Clamp, Filter::Nearest, 1.25), 1.0);
        assert_eq!(at(Wrap::Repeat, Filter::Nearest, -0.25), 1.0);
        assert_eq!(at(Wrap::Mirror, Filter::Nearest, -0.25), 0.0);
        // Across the border of a tile the neighbours are the other end, or the same texel again.
        assert_eq!(at(Wrap::Repeat, Filter::Linear, 0.0), 0.5);
        assert_eq!(at(Wrap::Mirror, Filter::Linear, 0.0), 0.0);
    }

    #[test]
    fn wild_coordinates_do_no_harm() {
        for u in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, -1e30] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                assert!(at(wrap, Filter::Linear, u).is_finite());
            }
        }
    }

    #[test]
    fn the_texture_transform_is_khronoss() {
        // Scale 2, a quarter turn, offset (0, 1): the matrix of the extension's text.
        let t = UvTransform::khr(Vec2::new(0.0, 1.0), std::f32::consts::FRAC_PI_2, Vec2::splat(2.0));
        assert!(t.apply(Vec2::new(1.0, 0.0)).abs_diff_eq(Vec2::new(0.0, -1.0), 1e-6));
        assert!(t.apply(Vec2::new(0.0, 1.0)).abs_diff_eq(Vec2::new(2.0, 1.0), 1e-6));
    }
}
