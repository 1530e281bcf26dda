//! How images are looked up.

use std::ops::{Add, Mul, Range};

use glam::{Vec2, Vec4};

use crate::scene::texture::image::{Image, TexelView};
use crate::scene::texture::mips::TexelSemantics;
use crate::scene::texture::srgb::decode_colors;

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
pub enum TextureFilter {
    /// The nearest texel.
    Nearest,
    /// Bilinear.
    #[default]
    Linear,
}

/// An image with its sampler.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Texture {
    /// Index of the image.
    pub image: u32,
    /// Wrapping along u and v.
    pub wrap: [Wrap; 2],
    /// Magnification filter.
    pub filter: TextureFilter,
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

    /// What a small step in the coordinates becomes.
    #[inline(always)]
    pub fn transform_vector(&self, by: Vec2) -> Vec2 {
        self.x_axis * by.x + self.y_axis * by.y
    }

    /// Applies it.
    #[inline(always)]
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        self.transform_vector(uv) + self.offset
    }

    /// By axis, what lies between the lowest and the highest of where three corners go, with slack for
    /// how what is between them is rounded.
    pub(crate) fn bounds(&self, uv: [Vec2; 3]) -> [[f64; 2]; 2] {
        let most = uv[0].abs().max(uv[1].abs()).max(uv[2].abs());
        let reach = (self.x_axis * most.x).abs() + (self.y_axis * most.y).abs() + self.offset.abs();
        // Where a corner is nowhere, all is: minima alone would pass over it.
        let strays = f64::from((uv[0] + uv[1] + uv[2]).element_sum()) * 0.0;
        let to = uv.map(|uv| self.apply(uv));
        let (low, high) = (to[0].min(to[1]).min(to[2]), to[0].max(to[1]).max(to[2]));
        [0, 1].map(|k| {
            let slack = 16.0 * f64::from(f32::EPSILON) * f64::from(reach[k]) + strays;
            [f64::from(low[k]) - slack, f64::from(high[k]) + slack]
        })
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

    pub(crate) fn set_offset(&mut self, offset: Vec2) {
        self.offset = offset;
    }

    pub(crate) fn set_rotation(&mut self, rotation: f32) {
        *self = UvTransform::khr(self.offset, rotation, self.scale);
    }

    pub(crate) fn set_scale(&mut self, scale: Vec2) {
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
    #[inline(always)]
    pub(crate) fn texel(self, i: i64, n: i64) -> usize {
        // Mostly it is that texel itself, and divisions are slow.
        if (0..n).contains(&i) {
            return i as usize;
        }
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

    /// The texels of `n` that lookups between two coordinates touch, interpolated or not.
    fn texels(self, [low, high]: [f64; 2], n: u32) -> [Range<usize>; 2] {
        let all = [0..n as usize, 0..0];
        let n = f64::from(n);
        let (first, last) = ((low * n - 0.5).floor(), (high * n - 0.5).floor() + 1.0);
        let inside = first >= 0.0 && last < n;
        let range = |first: f64, last: f64| first as usize..last as usize + 1;
        match self {
            // NaN is nowhere.
            _ if !(last - first + 1.0 < n) => all,
            _ if inside => [range(first, last), 0..0],
            Wrap::Clamp => [range(first.clamp(0.0, n - 1.0), last.clamp(0.0, n - 1.0)), 0..0],
            Wrap::Repeat => {
                let start = first.rem_euclid(n);
                let end = start + (last - first);
                if end < n { [range(start, end), 0..0] } else { [range(start, n - 1.0), range(0.0, end - n)] }
            }
            Wrap::Mirror => {
                let start = first.rem_euclid(2.0 * n);
                let end = start + (last - first);
                match () {
                    _ if end < n => [range(start, end), 0..0],
                    _ if start >= n && end < 2.0 * n => {
                        [range(2.0 * n - 1.0 - end, 2.0 * n - 1.0 - start), 0..0]
                    }
                    // Around an edge of the image.
                    _ => all,
                }
            }
        }
    }

    /// Brings a coordinate near 0…1 where that changes nothing, so that large ones keep their
    /// fraction and infinite ones do no harm.
    pub(crate) fn fold(self, x: f32) -> f64 {
        /// From here on an f32 is an even number.
        const WHOLE: f64 = (1u64 << 25) as f64;
        let x = f64::from(x);
        match self {
            // Mostly it is there, and the rest takes long.
            _ if (0.0..1.0).contains(&x) => x,
            _ if !x.is_finite() => 0.0,
            Wrap::Clamp => x.clamp(-1.0, 2.0),
            _ if x.abs() >= WHOLE => 0.0,
            Wrap::Repeat => x - floor(x) as f64,
            Wrap::Mirror => x - 2.0 * floor(0.5 * x) as f64,
        }
    }
}

/// The whole number at or below `x`, which is well within i64. The processors that this must run on
/// have no instruction for it, but one that rounds towards 0.
fn floor(x: f64) -> i64 {
    let i = x as i64;
    i - i64::from(i as f64 > x)
}

impl Texture {
    /// The texture's value at `uv` at its finest: colours decoded from sRGB, numbers as they are.
    pub fn sample(&self, images: &[Image], uv: Vec2, reading: TexelSemantics) -> Vec4 {
        self.finest(images[self.image as usize].plane(), uv, reading)
    }

    /// The same of the image itself.
    pub(crate) fn finest(&self, image: TexelView, uv: Vec2, reading: TexelSemantics) -> Vec4 {
        let colors = reading != TexelSemantics::Data;
        if self.filter == TextureFilter::Nearest {
            let i = self.nearest(image, uv);
            return if colors { image.decoded(i) } else { image.stored(i) };
        }
        match (colors, self.decode_last) {
            (false, _) => self.bilinear(image, uv, TexelView::stored),
            (true, false) => self.bilinear(image, uv, TexelView::decoded),
            (true, true) => decode_colors(self.bilinear(image, uv, TexelView::stored)),
        }
    }

    /// The alpha of [`Texture::sample`], for less.
    pub fn sample_alpha(&self, images: &[Image], uv: Vec2) -> f32 {
        let image = images[self.image as usize].plane();
        match self.filter {
            TextureFilter::Nearest => image.alpha(self.nearest(image, uv)),
            TextureFilter::Linear => self.bilinear(image, uv, TexelView::alpha),
        }
    }

    /// By axis, the texels of an image of this size that lookups within `bounds` touch.
    pub(crate) fn texels(&self, bounds: [[f64; 2]; 2], size: [u32; 2]) -> [[Range<usize>; 2]; 2] {
        [0, 1].map(|k| self.wrap[k].texels(bounds[k], size[k]))
    }

    /// The texel that `uv` is in.
    fn nearest(&self, image: TexelView, uv: Vec2) -> usize {
        let [wu, wv] = self.wrap;
        let place = |wrap: Wrap, x: f32, n: u32| wrap.texel(floor(wrap.fold(x) * f64::from(n)), i64::from(n));
        place(wv, uv.y, image.height) * image.width as usize + place(wu, uv.x, image.width)
    }

    /// Interpolates between the four texels about `uv`.
    pub(crate) fn bilinear<'a, T: Add<Output = T> + Mul<f32, Output = T>>(
        &self,
        plane: TexelView<'a>,
        uv: Vec2,
        texel: impl Fn(&TexelView<'a>, usize) -> T,
    ) -> T {
        let (w, h) = (i64::from(plane.width), i64::from(plane.height));
        let [wu, wv] = self.wrap;
        let (x, y) = (wu.fold(uv.x) * w as f64 - 0.5, wv.fold(uv.y) * h as f64 - 0.5);
        let (x0, y0) = (floor(x), floor(y));
        let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
        let (xa, xb) = (wu.texel(x0, w), wu.texel(x0 + 1, w));
        let (ya, yb) = (wv.texel(y0, h) * w as usize, wv.texel(y0 + 1, h) * w as usize);
        blend([ya + xa, ya + xb, yb + xa, yb + xb].map(|i| texel(&plane, i)), [fx, fy])
    }
}

/// Interpolates between four texels, the two of the upper row first, by the shares of the right and the lower ones.
#[inline(always)]
pub(crate) fn blend<T: Add<Output = T> + Mul<f32, Output = T>>(
    [a, b, c, d]: [T; 4],
    [fx, fy]: [f32; 2],
) -> T {
    let (top, bottom) = (a * (1.0 - fx) + b * fx, c * (1.0 - fx) + d * fx);
    top * (1.0 - fy) + bottom * fy
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Channels, MipMaps, Texels, srgb_to_linear};

    fn ramp() -> [Image; 1] {
        let texels = Texels::U8(vec![0, 255]);
        let mips = MipMaps::default();
        [Image { name: String::new(), width: 2, height: 1, channels: Channels::L, texels, mips }]
    }

    fn at(wrap: Wrap, filter: TextureFilter, u: f32) -> f32 {
        let texture = Texture { image: 0, wrap: [wrap; 2], filter, decode_last: false };
        texture.sample(&ramp(), Vec2::new(u, 0.5), TexelSemantics::Data).x
    }

    #[test]
    fn texels_are_hit_at_their_centres() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            assert_eq!(
                (at(wrap, TextureFilter::Linear, 0.25), at(wrap, TextureFilter::Linear, 0.75)),
                (0.0, 1.0)
            );
            assert_eq!(at(wrap, TextureFilter::Linear, 0.5), 0.5);
            assert_eq!(
                (at(wrap, TextureFilter::Nearest, 0.49), at(wrap, TextureFilter::Nearest, 0.51)),
                (0.0, 1.0)
            );
        }
    }

    #[test]
    fn wrapping_outside() {
        assert_eq!(at(Wrap::Repeat, TextureFilter::Nearest, 1.25), 0.0);
        assert_eq!(at(Wrap::Mirror, TextureFilter::Nearest, 1.25), 1.0);
        assert_eq!(at(Wrap::Clamp, TextureFilter::Nearest, 1.25), 1.0);
        assert_eq!(at(Wrap::Repeat, TextureFilter::Nearest, -0.25), 1.0);
        assert_eq!(at(Wrap::Mirror, TextureFilter::Nearest, -0.25), 0.0);
        // Across the border of a tile the neighbours are the other end, or the same texel again.
        assert_eq!(at(Wrap::Repeat, TextureFilter::Linear, 0.0), 0.5);
        assert_eq!(at(Wrap::Mirror, TextureFilter::Linear, 0.0), 0.0);
    }

    #[test]
    fn colours_are_decoded_before_or_after_they_are_filtered() {
        let middle = |decode_last| {
            let texture =
                Texture { image: 0, wrap: [Wrap::Clamp; 2], filter: TextureFilter::Linear, decode_last };
            texture.sample(&ramp(), Vec2::splat(0.5), TexelSemantics::Color).x
        };
        assert_eq!(middle(false), 0.5);
        assert!((middle(true) - srgb_to_linear(0.5)).abs() < 1e-5);
    }

    #[test]
    fn wild_coordinates_do_no_harm() {
        for u in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, -1e30] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                assert!(at(wrap, TextureFilter::Linear, u).is_finite());
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
