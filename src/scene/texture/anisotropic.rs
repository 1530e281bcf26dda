//! Anisotropic texture filtering over the footprint of a sample.
//!
//! The differentials of the texture coordinates turn a circle on the film into an ellipse on the texture.
//! Its short axis selects the mip level, and probes are averaged along its long axis, as graphics hardware
//! does (McCormack et al., “Feline”, 1999; EXT_texture_filter_anisotropic). Footprints within a texel are
//! sampled at full resolution.

use glam::{Vec2, Vec3, Vec4};

use crate::texture::downsample::{DownsampleFilter, unweight_by_alpha, weight_by_alpha};
use crate::texture::image::Image;
use crate::texture::mips::MipLevel;
use crate::texture::sampling::{Texture, TextureFilter};
use crate::texture::texels::{TexelSemantics, TexelView};

/// Differentials of the texture coordinates, from one sample to the next on the film.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Footprint {
    /// For a step to the right.
    pub dx: Vec2,
    /// For a step upwards.
    pub dy: Vec2,
}

/// Most probes along the long axis. Longer footprints use a smaller mip level.
const MAX_PROBES: f32 = 16.0;

/// The lookups for a footprint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Probes {
    /// Number in each of the two mip levels, an integer; 0 if the footprint is within a texel.
    pub count: f32,
    /// Distance between neighbours, in texture coordinates.
    pub step: Vec2,
    /// Width of a probe, in texels. It selects the mip level.
    pub width: f32,
}

impl Footprint {
    /// A point, which is sampled at full resolution.
    pub const POINT: Footprint = Footprint { dx: Vec2::ZERO, dy: Vec2::ZERO };

    /// Returns the differentials in texels of an image of this size.
    #[inline(always)]
    fn in_texels(&self, width: u32, height: u32) -> [Vec2; 2] {
        let size = Vec2::new(width as f32, height as f32);
        [self.dx * size, self.dy * size]
    }

    /// Returns true if the footprint is certainly within a texel of an image of this size. A fast test,
    /// which rarely misses one.
    #[inline(always)]
    pub(super) fn is_small(&self, width: u32, height: u32) -> bool {
        let [a, b] = self.in_texels(width, height);
        // Both axes of the ellipse are shorter than a texel.
        (a.x * a.x + b.x * b.x) + (a.y * a.y + b.y * b.y) < 0.99
    }

    /// Returns the probes in an image of this size. Has no branches, so that a loop over footprints is vectorised.
    #[inline(always)]
    pub(super) fn probes(&self, width: u32, height: u32) -> Probes {
        let size = Vec2::new(width as f32, height as f32);
        let is_small = self.is_small(width, height);
        let [a, b] = self.in_texels(width, height);
        // The ellipse is the image of the unit circle on the film; this is its covariance matrix.
        let (xx, xy, yy) = (a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y);
        let mean = 0.5 * (xx + yy);
        let half_difference = 0.5 * (xx - yy);
        let deviation = (half_difference * half_difference + xy * xy).sqrt();
        let long = (mean + deviation).sqrt();
        let short = (a.x * b.y - a.y * b.x).abs() / long;
        let width = short.max(long / MAX_PROBES).max(1.0);
        // An excess below a quarter is not worth another probe.
        let count = (long / width - 0.25).ceil().clamp(1.0, MAX_PROBES);
        let is_flat = half_difference >= 0.0;
        let axis = Vec2::new(
            if is_flat { half_difference + deviation } else { xy },
            if is_flat { xy } else { deviation - half_difference },
        );
        let step = axis.normalize_or_zero() * (long / count) / size;
        let is_finite = (mean + deviation).is_finite();
        let count = if is_small | !(long > 1.0) { 0.0 } else { count };
        Probes {
            count: if is_finite { count } else { 1.0 },
            step: if is_finite { step } else { Vec2::ZERO },
            width: if is_finite { width } else { f32::INFINITY },
        }
    }
}

impl Probes {
    /// No probes: a lookup at a point.
    pub const NONE: Probes = Probes { count: 0.0, step: Vec2::ZERO, width: 1.0 };

    /// Returns the mean over the probes around `uv` in a mip level.
    #[inline(always)]
    fn mean(&self, uv: Vec2, lookup: &impl LevelLookup, level: usize, view: TexelView) -> Vec4 {
        let first = 0.5 - 0.5 * self.count;
        let mut sum = Vec4::ZERO;
        for i in 0..self.count as u32 {
            sum += lookup.at(level, view, uv + self.step * (first + i as f32));
        }
        sum / self.count
    }

    /// Interpolates between the means over two mip levels (trilinear filtering); level 0 is `image`.
    #[inline(always)]
    fn trilinear(&self, uv: Vec2, image: TexelView, levels: &[MipLevel], lookup: &impl LevelLookup) -> Vec4 {
        let last = levels.len() as f32;
        let level = libm::log2f(self.width).min(last);
        let (low, weight) = (level as usize, level.fract());
        let mut means = [Vec4::ZERO; 2];
        let count = if weight > 0.0 { 2 } else { 1 };
        for (i, mean) in (low..).zip(&mut means[..count]) {
            let view = match i.checked_sub(1) {
                Some(i) => levels[i].view(),
                None => image,
            };
            *mean = self.mean(uv, lookup, i, view);
        }
        let [value, next] = means;
        if weight > 0.0 { value + (next - value) * weight } else { value }
    }
}

/// A lookup in a mip level. Not a closure: those are not inlined into each SIMD level's kernel.
trait LevelLookup {
    /// Returns the value at `uv` in the texels of a level; level 0 is the image.
    fn at(&self, level: usize, view: TexelView, uv: Vec2) -> Vec4;
}

/// Looks up colours and data.
struct ValueLookup<'t> {
    texture: &'t Texture,
    semantics: TexelSemantics,
}

impl LevelLookup for ValueLookup<'_> {
    #[inline(always)]
    fn at(&self, level: usize, view: TexelView, uv: Vec2) -> Vec4 {
        let value = self.texture.sample_level(level, view, uv, self.semantics);
        if self.semantics == TexelSemantics::AlphaWeightedColor { weight_by_alpha(value) } else { value }
    }
}

/// Looks up the vectors of a normal map.
struct NormalLookup<'t>(&'t Texture);

impl LevelLookup for NormalLookup<'_> {
    #[inline(always)]
    fn at(&self, level: usize, view: TexelView, uv: Vec2) -> Vec4 {
        let v = self.0.sample_level(level, view, uv, TexelSemantics::Normal);
        let n = decode_normal(v).normalize_or_zero();
        // The alpha of levels is the root of how much shorter than 1 the mean is.
        if level == 0 { n.extend(0.0) } else { (n * (1.0 - v.w * v.w)).extend(0.0) }
    }
}

impl Texture {
    /// Returns the texture's mean over `footprint` around `uv`.
    #[inline(always)]
    pub fn sample_filtered(
        &self,
        images: &[Image],
        uv: Vec2,
        footprint: &Footprint,
        semantics: TexelSemantics,
    ) -> Vec4 {
        let image = &images[self.image as usize];
        self.sample_probes(image, uv, &footprint.probes(image.width, image.height), semantics)
    }

    /// Returns the mean over probes around `uv`, or the value at `uv` if there are none.
    #[inline(always)]
    pub(super) fn sample_probes(
        &self,
        image: &Image,
        uv: Vec2,
        probes: &Probes,
        semantics: TexelSemantics,
    ) -> Vec4 {
        let view = image.view();
        let is_normal = semantics == TexelSemantics::Normal;
        if probes.count == 0.0 {
            let value = self.sample_level(0, view, uv, semantics);
            return if is_normal { decode_normal(value).extend(0.0) } else { value };
        }
        if is_normal {
            return self.mean_normal(image, uv, probes);
        }
        let alpha_weighted = semantics == TexelSemantics::AlphaWeightedColor;
        let encoded_bilinear = self.decode_last && self.filter == TextureFilter::Linear;
        let filter = match semantics {
            TexelSemantics::Data => DownsampleFilter::Data,
            _ if encoded_bilinear => DownsampleFilter::EncodedBilinear { alpha_weighted },
            _ => DownsampleFilter::Light { alpha_weighted },
        };
        let lookup = ValueLookup { texture: self, semantics };
        let v = probes.trilinear(uv, view, image.mips.levels(view, filter), &lookup);
        if alpha_weighted { unweight_by_alpha(v) } else { v }
    }

    /// Returns the mean direction of a normal map over `footprint` around `uv`, and the variance of the
    /// slopes along each axis, estimated from the length of the mean vector (Toksvig, “Mipmapping Normal
    /// Maps”, 2005).
    pub fn sample_normal_map(&self, images: &[Image], uv: Vec2, footprint: &Footprint) -> (Vec3, f32) {
        let value = self.sample_filtered(images, uv, footprint, TexelSemantics::Normal);
        (value.truncate(), value.w)
    }

    /// Returns the mean direction of a normal map over probes, and the variance of its slopes.
    #[inline(always)]
    fn mean_normal(&self, image: &Image, uv: Vec2, probes: &Probes) -> Vec4 {
        let view = image.view();
        let levels = image.mips.levels(view, DownsampleFilter::Normals);
        let mean = probes.trilinear(uv, view, levels, &NormalLookup(self)).truncate();
        let length = mean.length().clamp(0.01, 1.0);
        mean.normalize_or(Vec3::Z).extend((1.0 - length) / length)
    }
}

/// Decodes the vector of a normal map's texel.
#[inline(always)]
pub(super) fn decode_normal(texel: Vec4) -> Vec3 {
    texel.truncate() * 2.0 - Vec3::ONE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channels, MipMaps, Texels, Wrap};

    fn footprint(right: (f32, f32), up: (f32, f32)) -> Footprint {
        Footprint { dx: right.into(), dy: up.into() }
    }

    #[test]
    fn magnified_textures_need_no_filtering() {
        assert_eq!(Footprint::POINT.probes(4096, 4096).count, 0.0);
        assert_eq!(footprint((1e-3, 0.0), (0.0, 1e-3)).probes(1000, 999).count, 0.0);
        assert_eq!(footprint((1e-3, 0.0), (0.0, 1e-3)).probes(1, 1).count, 0.0);
    }

    #[test]
    fn the_short_axis_picks_the_level_and_the_long_one_the_probes() {
        for turn in 0..24 {
            // An ellipse of 4 by 32 texels, rotated on the film and on the texture.
            let (film, texture) = (turn as f32 * 0.7, turn as f32 * 0.31);
            let (long, short) = (Vec2::from_angle(texture) * 32.0, Vec2::from_angle(texture).perp() * 4.0);
            let (c, s) = (libm::cosf(film), libm::sinf(film));
            let footprint =
                Footprint { dx: (long * c + short * s) / 64.0, dy: (short * c - long * s) / 64.0 };
            let probes = footprint.probes(64, 64);
            assert_eq!(probes.count, 8.0, "{turn}");
            assert!((probes.width - 4.0).abs() < 1e-3, "{turn}: {probes:?}");
            let step = probes.step * 64.0;
            assert!((step.length() - 4.0).abs() < 1e-3, "{turn}: {probes:?}");
            assert!(step.normalize().perp_dot(long.normalize()).abs() < 1e-3, "{turn}: {probes:?}");
        }
    }

    #[test]
    fn very_long_footprints_use_smaller_levels() {
        let probes = footprint((0.0, 0.0), (1.0, 0.0)).probes(1024, 1024);
        assert_eq!((probes.count, probes.width), (16.0, 64.0));
    }

    #[test]
    fn extreme_footprints_give_values_in_range() {
        let images: Vec<Image> = [(1, 1), (5, 3), (1, 64)]
            .map(|(width, height)| {
                let texels = Texels::U8((0..width * height * 3).map(|i| (i * 5) as u8).collect());
                Image {
                    name: String::new(),
                    width,
                    height,
                    channels: Channels::Rgb,
                    texels,
                    mips: MipMaps::default(),
                }
            })
            .into();
        let extremes = [0.0, 1e-30, 0.3, -7.0, 1e10, -1e30, f32::MAX, f32::INFINITY, f32::NAN];
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for filter in [TextureFilter::Nearest, TextureFilter::Linear] {
                for (i, decode_last) in (0..images.len() as u32).flat_map(|i| [(i, false), (i, true)]) {
                    let texture = Texture { image: i, wrap: [wrap; 2], filter, decode_last };
                    for (a, b) in extremes.iter().flat_map(|&a| extremes.map(|b| (a, b))) {
                        let footprint = footprint((a, b), (b, a));
                        for uv in [Vec2::new(0.2, 0.7), Vec2::new(a, b)] {
                            for semantics in [
                                TexelSemantics::Color,
                                TexelSemantics::AlphaWeightedColor,
                                TexelSemantics::Data,
                            ] {
                                let v = texture.sample_filtered(&images, uv, &footprint, semantics);
                                assert!(
                                    v.cmpge(Vec4::ZERO).all() && v.cmple(Vec4::splat(1.0001)).all(),
                                    "{v}"
                                );
                            }
                            let (n, variance) = texture.sample_normal_map(&images, uv, &footprint);
                            assert!(n.is_finite() && variance.is_finite());
                        }
                    }
                }
            }
        }
    }
}
