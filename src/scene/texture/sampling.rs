//! Textures, and point and bilinear lookups at full resolution.

use std::ops::{Add, Mul, Range};

use glam::{Vec2, Vec4};

use crate::texture::image::Image;
use crate::texture::srgb::decode_colors;
use crate::texture::texels::{TexelSemantics, TexelView};
use crate::texture::uv_transform::UvTransform;
use crate::texture::wrap::{Wrap, floor};

/// The magnification filter of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum TextureFilter {
    /// The nearest texel.
    Nearest,
    /// Bilinear interpolation.
    #[default]
    Linear,
}

/// An image with its sampler.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Texture {
    /// Index of the image.
    pub image: u32,
    /// Wrap modes along u and v.
    pub wrap: [Wrap; 2],
    /// Magnification filter.
    pub filter: TextureFilter,
    /// True filters encoded colours and decodes the result from sRGB, as Blender does. False decodes
    /// first, as glTF requires.
    pub decode_last: bool,
}

/// A reference of a material to a texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index of the texture.
    pub texture: u32,
    /// Set of texture coordinates.
    pub uv_set: u32,
    /// Applied to the texture coordinates.
    pub transform: UvTransform,
}

impl Texture {
    /// Samples the texture at `uv`, at full resolution. Colours are decoded from sRGB.
    pub fn sample(&self, images: &[Image], uv: Vec2, semantics: TexelSemantics) -> Vec4 {
        self.sample_level(0, images[self.image as usize].view(), uv, semantics)
    }

    /// Samples a mip level: the image at level 0, where texels may be nearest, or decoded after filtering. The other levels
    /// hold linear light, encoded.
    #[inline(always)]
    pub(super) fn sample_level(
        &self,
        level: usize,
        view: TexelView,
        uv: Vec2,
        semantics: TexelSemantics,
    ) -> Vec4 {
        let colors = semantics.is_color();
        if level == 0 && self.filter == TextureFilter::Nearest {
            let i = self.nearest(view, uv);
            return if colors { view.decoded(i) } else { view.stored(i) };
        }
        let decode_last = colors && self.decode_last && level == 0;
        let value = self.bilinear(view, uv, colors && !decode_last);
        if decode_last { decode_colors(value) } else { value }
    }

    /// Samples only the alpha of [`Texture::sample`], which is faster.
    pub fn sample_alpha(&self, images: &[Image], uv: Vec2) -> f32 {
        let image = images[self.image as usize].view();
        match self.filter {
            TextureFilter::Nearest => image.alpha(self.nearest(image, uv)),
            TextureFilter::Linear => {
                let quad = self.texel_quad(image, uv);
                bilerp(quad.indices.map(|i| image.alpha(i)), quad.weights)
            }
        }
    }

    /// Returns, for each axis, the texels of an image of this size that lookups within `bounds` can touch.
    pub(crate) fn texel_ranges(&self, bounds: [[f64; 2]; 2], size: [u32; 2]) -> [[Range<usize>; 2]; 2] {
        [0, 1].map(|k| self.wrap[k].texel_ranges(bounds[k], size[k]))
    }

    /// Returns the index of the texel that contains `uv`.
    fn nearest(&self, image: TexelView, uv: Vec2) -> usize {
        let [wu, wv] = self.wrap;
        let texel =
            |wrap: Wrap, x: f32, n: u32| wrap.texel(floor(wrap.fold(x) * f64::from(n)).0, i64::from(n));
        texel(wv, uv.y, image.height) * image.width as usize + texel(wu, uv.x, image.width)
    }

    /// Interpolates between the four texels around `uv`, with colours decoded from sRGB if `decode` is set.
    #[inline(always)]
    pub(super) fn bilinear(&self, view: TexelView, uv: Vec2, decode: bool) -> Vec4 {
        let TexelQuad { indices, weights } = self.texel_quad(view, uv);
        bilerp(if decode { view.decoded_many(indices) } else { view.stored_many(indices) }, weights)
    }

    /// The four texels around `uv`.
    #[inline(always)]
    fn texel_quad(&self, view: TexelView, uv: Vec2) -> TexelQuad {
        let (w, h) = (i64::from(view.width), i64::from(view.height));
        let [wu, wv] = self.wrap;
        let (x, y) = (wu.fold(uv.x) * w as f64 - 0.5, wv.fold(uv.y) * h as f64 - 0.5);
        let ((x0, x_floor), (y0, y_floor)) = (floor(x), floor(y));
        let (xa, xb) = (wu.texel(x0, w), wu.texel(x0 + 1, w));
        let (ya, yb) = (wv.texel(y0, h) * w as usize, wv.texel(y0 + 1, h) * w as usize);
        let weights = [(x - x_floor) as f32, (y - y_floor) as f32];
        TexelQuad { indices: [ya + xa, ya + xb, yb + xa, yb + xb], weights }
    }
}

/// Four texels of two rows, upper row first.
struct TexelQuad {
    indices: [usize; 4],
    /// Weights of the right and of the lower texels.
    weights: [f32; 2],
}

/// Interpolates bilinearly between four texels, upper row first, by the weights of the right and the
/// lower ones.
#[inline(always)]
pub(super) fn bilerp<T: Add<Output = T> + Mul<f32, Output = T>>(
    [a, b, c, d]: [T; 4],
    [fx, fy]: [f32; 2],
) -> T {
    let (top, bottom) = (a * (1.0 - fx) + b * fx, c * (1.0 - fx) + d * fx);
    top * (1.0 - fy) + bottom * fy
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channels, MipMaps, Texels, srgb_to_linear};

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
    fn coordinates_of_texel_centres_give_the_texels() {
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
    fn wrap_modes_continue_the_texture() {
        assert_eq!(at(Wrap::Repeat, TextureFilter::Nearest, 1.25), 0.0);
        assert_eq!(at(Wrap::Mirror, TextureFilter::Nearest, 1.25), 1.0);
        assert_eq!(at(Wrap::Clamp, TextureFilter::Nearest, 1.25), 1.0);
        assert_eq!(at(Wrap::Repeat, TextureFilter::Nearest, -0.25), 1.0);
        assert_eq!(at(Wrap::Mirror, TextureFilter::Nearest, -0.25), 0.0);
        // At the edge of a tile, the neighbour is the texel at the other end, or the same texel again.
        assert_eq!(at(Wrap::Repeat, TextureFilter::Linear, 0.0), 0.5);
        assert_eq!(at(Wrap::Mirror, TextureFilter::Linear, 0.0), 0.0);
    }

    #[test]
    fn colours_are_decoded_before_or_after_filtering() {
        let value = |decode_last| {
            let texture =
                Texture { image: 0, wrap: [Wrap::Clamp; 2], filter: TextureFilter::Linear, decode_last };
            texture.sample(&ramp(), Vec2::splat(0.5), TexelSemantics::Color).x
        };
        assert_eq!(value(false), 0.5);
        assert!((value(true) - srgb_to_linear(0.5)).abs() < 1e-5);
    }

    #[test]
    fn extreme_coordinates_give_finite_values() {
        for u in [f32::NAN, f32::INFINITY, -f32::INFINITY, 1e30, -1e30] {
            for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                assert!(at(wrap, TextureFilter::Linear, u).is_finite());
            }
        }
    }
}
