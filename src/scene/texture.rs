//! Images and how they are looked up.

use std::sync::OnceLock;

use glam::{Vec2, Vec3, Vec4};

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

/// What an image's channels hold, as its file stored them: nothing is widened on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Grey.
    L = 1,
    /// Grey and alpha.
    La = 2,
    /// Red, green and blue.
    Rgb = 3,
    /// Red, green, blue and alpha; not premultiplied.
    Rgba = 4,
}

/// The numbers of an image: row-major, row 0 on top, the channels of a texel side by side.
#[derive(Clone, Debug)]
pub enum Texels {
    /// 8 bits a channel.
    U8(Vec<u8>),
    /// 16 bits a channel.
    U16(Vec<u16>),
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
    /// What a texel has.
    pub channels: Channels,
    /// `width · height` texels of that many channels.
    pub texels: Texels,
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
    /// True: colours are filtered as they are stored and decoded from sRGB afterwards, as Blender
    /// does; false: decoded first, as glTF asks.
    pub decode_last: bool,
}

/// `uv' = M·uv + t`: KHR_texture_transform and MTL's `-s` and `-o`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    offset: Vec2,
    rotation: f32,
    scale: Vec2,
    /// Columns of M, which follow from rotation and scale.
    x_axis: Vec2,
    y_axis: Vec2,
}

impl UvTransform {
    /// Coordinates as they are.
    pub const IDENTITY: UvTransform =
        UvTransform { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE, x_axis: Vec2::X, y_axis: Vec2::Y };

    /// KHR_texture_transform: scale, then rotate by `rotation` radians (counter-clockwise in the
    /// image, so clockwise in uv), then offset.
    pub fn khr(offset: Vec2, rotation: f32, scale: Vec2) -> UvTransform {
        let (s, c) = (libm::sinf(rotation), libm::cosf(rotation));
        let (x_axis, y_axis) = (Vec2::new(c, -s) * scale.x, Vec2::new(s, c) * scale.y);
        UvTransform { offset, rotation, scale, x_axis, y_axis }
    }

    /// Applies it.
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        self.x_axis * uv.x + self.y_axis * uv.y + self.offset
    }

    /// t.
    pub fn offset(&self) -> Vec2 {
        self.offset
    }

    /// The rotation in radians.
    pub fn rotation(&self) -> f32 {
        self.rotation
    }

    /// The scale, which comes before the rotation.
    pub fn scale(&self) -> Vec2 {
        self.scale
    }

    pub(super) fn set_offset(&mut self, offset: Vec2) {
        self.offset = offset;
    }

    pub(super) fn set_rotation(&mut self, rotation: f32) {
        *self = UvTransform::khr(self.offset, rotation, self.scale);
    }

    pub(super) fn set_scale(&mut self, scale: Vec2) {
        *self = UvTransform::khr(self.offset, self.rotation, scale);
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
    /// Bytes of its texels.
    pub fn bytes(&self) -> u64 {
        match &self.texels {
            Texels::U8(t) => t.len() as u64,
            Texels::U16(t) => 2 * t.len() as u64,
        }
    }

    /// Texel `i` of the row-major list as stored: red, green, blue, alpha in 0…1, neither decoded
    /// nor filtered. Grey is all three colours; alpha is 1 where there is none.
    pub fn stored(&self, i: usize) -> Vec4 {
        let n = self.channels as usize;
        let at = |c: usize| match &self.texels {
            Texels::U8(t) => linear_table()[usize::from(t[n * i + c])],
            Texels::U16(t) => f32::from(t[n * i + c]) / 65535.0,
        };
        spread(self.channels, at)
    }

    fn texel(&self, x: usize, y: usize, srgb: bool) -> Vec4 {
        let i = y * self.width as usize + x;
        if !srgb {
            return self.stored(i);
        }
        let n = self.channels as usize;
        match &self.texels {
            Texels::U8(t) => {
                let mut v = spread(self.channels, |c| srgb_table()[usize::from(t[n * i + c])]);
                // The table decodes colours; alpha is linear always.
                if matches!(self.channels, Channels::La | Channels::Rgba) {
                    v.w = f32::from(t[n * i + n - 1]) / 255.0;
                }
                v
            }
            Texels::U16(_) => {
                let v = self.stored(i);
                Vec4::new(srgb_to_linear(v.x), srgb_to_linear(v.y), srgb_to_linear(v.z), v.w)
            }
        }
    }
}

/// The four channels of a texel that has some of them.
fn spread(channels: Channels, at: impl Fn(usize) -> f32) -> Vec4 {
    match channels {
        Channels::L => Vec3::splat(at(0)).extend(1.0),
        Channels::La => Vec3::splat(at(0)).extend(at(1)),
        Channels::Rgb => Vec4::new(at(0), at(1), at(2), 1.0),
        Channels::Rgba => Vec4::new(at(0), at(1), at(2), at(3)),
    }
}

impl Texture {
    /// The texture's value at `uv` at its finest level, colours decoded from sRGB where `srgb` says
    /// so; alpha is linear always.
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
        let first = srgb && !self.decode_last;
        let top = image.texel(xa, ya, first) * (1.0 - fx) + image.texel(xb, ya, first) * fx;
        let bottom = image.texel(xa, yb, first) * (1.0 - fx) + image.texel(xb, yb, first) * fx;
        let v = top * (1.0 - fy) + bottom * fy;
        if srgb && self.decode_last { Vec3::from(v.truncate().to_array().map(decode)).extend(v.w) } else { v }
    }
}

/// IEC 61966-2-1: an encoded value in 0…1 to linear light.
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

/// [`srgb_to_linear`] between two codes of 8 bits, within 1e-5 of it.
fn decode(v: f32) -> f32 {
    let x = (v * 255.0).clamp(0.0, 255.0);
    let low = (x as usize).min(254);
    let [a, b] = [srgb_table()[low], srgb_table()[low + 1]];
    a + (b - a) * (x - low as f32)
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
        [image(Channels::L, Texels::U8(vec![0, 255]))]
    }

    /// Two texels side by side.
    fn image(channels: Channels, texels: Texels) -> Image {
        Image { name: String::new(), width: 2, height: 1, channels, texels }
    }

    #[test]
    fn every_layout_is_read_as_four_channels() {
        let eight = |channels, texels: &[u8]| image(channels, Texels::U8(texels.to_vec()));
        let half = srgb_to_linear(51.0 / 255.0);
        for (image, stored, decoded) in [
            (eight(Channels::L, &[0, 51]), [0.2, 0.2, 0.2, 1.0], [half, half, half, 1.0]),
            (eight(Channels::La, &[0, 0, 51, 51]), [0.2; 4], [half, half, half, 0.2]),
            (eight(Channels::Rgb, &[0, 0, 0, 255, 0, 51]), [1.0, 0.0, 0.2, 1.0], [1.0, 0.0, half, 1.0]),
            (
                eight(Channels::Rgba, &[0, 0, 0, 0, 255, 0, 51, 51]),
                [1.0, 0.0, 0.2, 0.2],
                [1.0, 0.0, half, 0.2],
            ),
            (image(Channels::La, Texels::U16(vec![0, 0, 13107, 13107])), [0.2; 4], [half, half, half, 0.2]),
        ] {
            assert!(image.stored(1).abs_diff_eq(stored.into(), 1e-7), "{image:?}");
            assert!(image.texel(1, 0, true).abs_diff_eq(decoded.into(), 1e-7), "{image:?}");
            assert_eq!(image.texel(1, 0, false), image.stored(1));
        }
    }

    fn at(wrap: Wrap, filter: Filter, u: f32) -> f32 {
        let texture = Texture { image: 0, wrap: [wrap; 2], filter, decode_last: false };
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
    fn colours_are_decoded_before_or_after_they_are_filtered() {
        let middle = |decode_last| {
            let texture = Texture { image: 0, wrap: [Wrap::Clamp; 2], filter: Filter::Linear, decode_last };
            texture.sample(&ramp(), Vec2::splat(0.5), true).x
        };
        assert_eq!(middle(false), 0.5);
        assert!((middle(true) - srgb_to_linear(0.5)).abs() < 1e-5);
        for i in 0..=4096 {
            let v = i as f32 / 4096.0;
            assert!((decode(v) - srgb_to_linear(v)).abs() < 1e-5, "{v}");
        }
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
