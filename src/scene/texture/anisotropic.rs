//! Textures over the area that a sample stands for.
//!
//! The step from a sample to its neighbours on the film becomes, on the texture, a parallelogram; the
//! ellipse that it stands for has a short axis, which picks the level of the pyramid, and a long one,
//! along which probes are averaged (as hardware does: McCormack et al., “Feline”, 1999, and
//! EXT_texture_filter_anisotropic). Below a texel there is nothing to filter: magnified textures
//! are looked up at their finest.

use glam::{Vec2, Vec3, Vec4};

use crate::scene::texture::image::{Image, TexelView};
use crate::scene::texture::mips::{CLEAR, DownsampleFilter, MipLevel, TexelSemantics};
use crate::scene::texture::sampling::{Texture, TextureFilter};

/// How texture coordinates change from a sample to the next one to the right and upward on the film.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Footprint {
    /// To the right.
    pub dx: Vec2,
    /// Upward.
    pub dy: Vec2,
}

impl Footprint {
    /// A point: textures are looked up at their finest.
    pub const POINT: Footprint = Footprint { dx: Vec2::ZERO, dy: Vec2::ZERO };
}

/// Probes along the long axis at most; a longer footprint is looked up at a smaller copy.
const MOST_PROBES: f32 = 16.0;

/// Where a texture is looked up, and how often.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Probes {
    /// In each of two neighbouring levels.
    count: u32,
    /// From one to the next, in texture coordinates.
    step: Vec2,
    /// 0 is the image itself; the fraction says how much the next smaller level counts.
    level: f32,
}

impl Footprint {
    /// The steps in texels of an image of this size.
    #[inline(always)]
    fn in_texels(&self, width: u32, height: u32) -> [Vec2; 2] {
        let size = Vec2::new(width as f32, height as f32);
        [self.dx * size, self.dy * size]
    }

    /// True where it is within a texel of an image of this size for sure, as it mostly is where it is.
    #[inline(always)]
    pub(crate) fn is_small(&self, width: u32, height: u32) -> bool {
        let [a, b] = self.in_texels(width, height);
        // Both axes of the ellipse are shorter than a texel.
        (a.x * a.x + b.x * b.x) + (a.y * a.y + b.y * b.y) < 0.99
    }

    /// `None` where the footprint is within a texel of an image of this size.
    fn probes(&self, width: u32, height: u32) -> Option<Probes> {
        if self.is_small(width, height) {
            return None;
        }
        let size = Vec2::new(width as f32, height as f32);
        let [a, b] = self.in_texels(width, height);
        // Steps of unit length on the film become an ellipse; these are its covariances.
        let (xx, xy, yy) = (a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y);
        let middle = 0.5 * (xx + yy);
        let half = 0.5 * (xx - yy);
        let apart = (half * half + xy * xy).sqrt();
        if !(middle + apart).is_finite() {
            return Some(Probes { count: 1, step: Vec2::ZERO, level: f32::INFINITY });
        }
        let long = (middle + apart).sqrt();
        if !(long > 1.0) {
            return None;
        }
        let short = (a.x * b.y - a.y * b.x).abs() / long;
        let width = short.max(long / MOST_PROBES).max(1.0);
        // Less than a quarter too long is not worth another probe.
        let count = (long / width - 0.25).ceil().clamp(1.0, MOST_PROBES);
        let axis = if half >= 0.0 { Vec2::new(half + apart, xy) } else { Vec2::new(xy, apart - half) };
        let step = axis.normalize_or_zero() * (long / count) / size;
        Some(Probes { count: count as u32, step, level: libm::log2f(width) })
    }
}

impl Probes {
    /// The mean of what `at` finds at the probes about `uv`.
    fn mean(&self, uv: Vec2, at: impl Fn(Vec2) -> Vec4) -> Vec4 {
        let first = 0.5 - 0.5 * self.count as f32;
        let sum: Vec4 = (0..self.count).map(|i| at(uv + self.step * (first + i as f32))).sum();
        sum / self.count as f32
    }

    /// The mean over the two levels between which these probes lie; `finest` looks up the image.
    fn through(
        &self,
        uv: Vec2,
        levels: &[MipLevel],
        finest: impl Fn(Vec2) -> Vec4,
        smaller: impl Fn(TexelView, Vec2) -> Vec4,
    ) -> Vec4 {
        let last = levels.len() as f32;
        let level = self.level.min(last);
        let (low, between) = (level as usize, level.fract());
        let at = |i: usize| match i.checked_sub(1) {
            None => self.mean(uv, &finest),
            Some(i) => self.mean(uv, |uv| smaller(levels[i].plane(), uv)),
        };
        let value = at(low);
        if between > 0.0 { value + (at(low + 1) - value) * between } else { value }
    }
}

impl Texture {
    /// The texture's mean over `footprint` about `uv`.
    pub fn sample_filtered(
        &self,
        images: &[Image],
        uv: Vec2,
        footprint: &Footprint,
        reading: TexelSemantics,
    ) -> Vec4 {
        let image = &images[self.image as usize];
        let plane = image.plane();
        let Some(probes) = footprint.probes(image.width, image.height) else {
            return self.finest(plane, uv, reading);
        };
        let covered = reading == TexelSemantics::AlphaWeightedColor;
        let interpolated = self.decode_last && self.filter == TextureFilter::Linear;
        let mean = match reading {
            TexelSemantics::Data => DownsampleFilter::Numbers,
            _ if interpolated => DownsampleFilter::Shown { covered },
            _ => DownsampleFilter::Light { covered },
        };
        // Colours of which only as much is seen as alpha leaves have that weight in every mean.
        let weigh = |v: Vec4| if covered { (v.truncate() * (v.w + CLEAR)).extend(v.w) } else { v };
        let finest = |uv| weigh(self.finest(plane, uv, reading));
        let smaller = |plane: TexelView, uv| {
            weigh(match reading {
                TexelSemantics::Data => self.bilinear(plane, uv, TexelView::stored),
                _ => self.bilinear(plane, uv, TexelView::decoded),
            })
        };
        let v = probes.through(uv, image.mips.of(plane, mean), finest, smaller);
        if covered { (v.truncate() / (v.w + CLEAR)).extend(v.w) } else { v }
    }

    /// The vector that a normal map's texel stands for.
    pub fn decode_normal(texel: Vec4) -> Vec3 {
        texel.truncate() * 2.0 - Vec3::ONE
    }

    /// The mean of a normal map's vectors over `footprint` about `uv`, and how far they spread: the
    /// variance of their slopes along each axis, by how much shorter than 1 the mean is (Toksvig,
    /// “Mipmapping Normal Maps”, 2005).
    pub fn sample_normal_map(&self, images: &[Image], uv: Vec2, footprint: &Footprint) -> (Vec3, f32) {
        let image = &images[self.image as usize];
        let plane = image.plane();
        let finest = |uv| Texture::decode_normal(self.finest(plane, uv, TexelSemantics::Data));
        let Some(probes) = footprint.probes(image.width, image.height) else {
            return (finest(uv), 0.0);
        };
        let unit = |uv| finest(uv).normalize_or_zero().extend(0.0);
        let smaller = |plane: TexelView, uv| {
            let v = self.bilinear(plane, uv, TexelView::stored);
            let n = Texture::decode_normal(v).normalize_or_zero();
            (n * (1.0 - v.w * v.w)).extend(0.0)
        };
        let mean =
            probes.through(uv, image.mips.of(plane, DownsampleFilter::Normals), unit, smaller).truncate();
        let length = mean.length().clamp(0.01, 1.0);
        (mean.normalize_or(Vec3::Z), (1.0 - length) / length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Channels, MipMaps, Texels, Wrap};

    fn footprint(right: (f32, f32), up: (f32, f32)) -> Footprint {
        Footprint { dx: right.into(), dy: up.into() }
    }

    #[test]
    fn magnified_textures_have_no_probes() {
        assert_eq!(Footprint::POINT.probes(4096, 4096), None);
        assert_eq!(footprint((1e-3, 0.0), (0.0, 1e-3)).probes(1000, 999), None);
        assert_eq!(footprint((1e-3, 0.0), (0.0, 1e-3)).probes(1, 1), None);
    }

    #[test]
    fn the_short_axis_picks_the_level_and_the_long_one_the_probes() {
        for turn in 0..24 {
            // An ellipse of 4 by 32 texels, however it lies on the film and on the texture.
            let (film, texture) = (turn as f32 * 0.7, turn as f32 * 0.31);
            let (long, short) = (Vec2::from_angle(texture) * 32.0, Vec2::from_angle(texture).perp() * 4.0);
            let (c, s) = (libm::cosf(film), libm::sinf(film));
            let over = Footprint { dx: (long * c + short * s) / 64.0, dy: (short * c - long * s) / 64.0 };
            let probes = over.probes(64, 64).unwrap();
            assert_eq!(probes.count, 8, "{turn}");
            assert!((probes.level - 2.0).abs() < 1e-3, "{turn}: {probes:?}");
            let step = probes.step * 64.0;
            assert!((step.length() - 4.0).abs() < 1e-3, "{turn}: {probes:?}");
            assert!(step.normalize().perp_dot(long.normalize()).abs() < 1e-3, "{turn}: {probes:?}");
        }
    }

    #[test]
    fn very_long_footprints_go_to_smaller_copies() {
        let probes = footprint((0.0, 0.0), (1.0, 0.0)).probes(1024, 1024).unwrap();
        assert_eq!((probes.count, probes.level), (16, 6.0));
    }

    #[test]
    fn no_footprint_does_harm() {
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
        let wild = [0.0, 1e-30, 0.3, -7.0, 1e10, -1e30, f32::MAX, f32::INFINITY, f32::NAN];
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for filter in [TextureFilter::Nearest, TextureFilter::Linear] {
                for (i, decode_last) in (0..images.len() as u32).flat_map(|i| [(i, false), (i, true)]) {
                    let texture = Texture { image: i, wrap: [wrap; 2], filter, decode_last };
                    for (a, b) in wild.iter().flat_map(|&a| wild.map(|b| (a, b))) {
                        let over = footprint((a, b), (b, a));
                        for uv in [Vec2::new(0.2, 0.7), Vec2::new(a, b)] {
                            for reading in [
                                TexelSemantics::Color,
                                TexelSemantics::AlphaWeightedColor,
                                TexelSemantics::Data,
                            ] {
                                let v = texture.sample_filtered(&images, uv, &over, reading);
                                assert!(
                                    v.cmpge(Vec4::ZERO).all() && v.cmple(Vec4::splat(1.0001)).all(),
                                    "{v}"
                                );
                            }
                            let (n, spread) = texture.sample_normal_map(&images, uv, &over);
                            assert!(n.is_finite() && spread.is_finite());
                        }
                    }
                }
            }
        }
    }
}
