//! Texture lookups for a batch of sample points in SoA layout.
//!
//! The arithmetic before the texel reads is vectorised over the batch. Results are bit-identical
//! to [`Texture::sample_filtered`].

use std::ops::Range;

use glam::{Vec2, Vec4};

use crate::texture::anisotropic::{Footprint, Probes, decode_normal};
use crate::texture::image::Image;
use crate::texture::sampling::{Texture, TextureFilter, bilerp};
use crate::texture::srgb::decode_colors;
use crate::texture::texels::TexelSemantics;
use crate::texture::wrap::{Wrap, floor};

/// Texture coordinates and footprints of N sample points, in SoA layout.
#[derive(Clone, Copy, Debug)]
pub struct SampleCoords<const N: usize> {
    uv: [[f32; N]; 2],
    dx: [[f32; N]; 2],
    dy: [[f32; N]; 2],
}

impl<const N: usize> SampleCoords<N> {
    /// All points at the origin, with point footprints.
    pub const ORIGIN: SampleCoords<N> =
        SampleCoords { uv: [[0.0; N]; 2], dx: [[0.0; N]; 2], dy: [[0.0; N]; 2] };

    /// Sets point `i`.
    #[inline(always)]
    pub fn set(&mut self, i: usize, uv: Vec2, footprint: Footprint) {
        for axis in 0..2 {
            self.uv[axis][i] = uv[axis];
            self.dx[axis][i] = footprint.dx[axis];
            self.dy[axis][i] = footprint.dy[axis];
        }
    }

    #[inline(always)]
    fn uv(&self, i: usize) -> Vec2 {
        Vec2::new(self.uv[0][i], self.uv[1][i])
    }

    #[inline(always)]
    fn footprint(&self, i: usize) -> Footprint {
        let vec2 = |of: &[[f32; N]; 2]| Vec2::new(of[0][i], of[1][i]);
        Footprint { dx: vec2(&self.dx), dy: vec2(&self.dy) }
    }
}

/// Positions between two neighbouring texels along one axis.
struct TexelPairs<const N: usize> {
    /// The lower texel.
    first: [i64; N],
    /// Weight of the upper texel.
    weight: [f32; N],
}

impl<const N: usize> TexelPairs<N> {
    #[inline(always)]
    fn new(wrap: Wrap, x: &[f32; N], texels: u32) -> TexelPairs<N> {
        // Coordinates outside 0…1 are rare.
        let inside = x.iter().all(|x| (0.0..1.0).contains(x));
        let mut folded = [0.0; N];
        for (folded, x) in folded.iter_mut().zip(x) {
            *folded = if inside { f64::from(*x) } else { wrap.fold(*x) };
        }
        let mut pairs = TexelPairs { first: [0; N], weight: [0.0; N] };
        for ((folded, first), weight) in folded.iter().zip(&mut pairs.first).zip(&mut pairs.weight) {
            let x = folded * f64::from(texels) - 0.5;
            let (texel, floor) = floor(x);
            *first = texel;
            *weight = (x - floor) as f32;
        }
        pairs
    }

    /// Returns both texels of point `i`, and the weight of the second.
    #[inline(always)]
    fn at(&self, i: usize, wrap: Wrap, texels: u32) -> (usize, usize, f32) {
        let (first, texels) = (self.first[i], i64::from(texels));
        (wrap.texel(first, texels), wrap.texel(first + 1, texels), self.weight[i])
    }
}

/// The probes of N footprints.
struct ProbeLanes<const N: usize> {
    count: [f32; N],
    step: [[f32; N]; 2],
    width: [f32; N],
}

impl<const N: usize> ProbeLanes<N> {
    #[inline(always)]
    fn new(coords: &SampleCoords<N>, image: &Image) -> ProbeLanes<N> {
        let mut lanes = ProbeLanes { count: [0.0; N], step: [[0.0; N]; 2], width: [0.0; N] };
        for i in 0..N {
            let Probes { count, step, width } = coords.footprint(i).probes(image.width, image.height);
            lanes.count[i] = count;
            lanes.step[0][i] = step.x;
            lanes.step[1][i] = step.y;
            lanes.width[i] = width;
        }
        lanes
    }

    #[inline(always)]
    fn get(&self, i: usize) -> Probes {
        let step = Vec2::new(self.step[0][i], self.step[1][i]);
        Probes { count: self.count[i], step, width: self.width[i] }
    }
}

impl Texture {
    /// Samples the texture at `points` of `coords` like [`Texture::sample_filtered`].
    #[inline(always)]
    pub fn sample_batch<const N: usize>(
        &self,
        images: &[Image],
        coords: &SampleCoords<N>,
        semantics: TexelSemantics,
        points: Range<usize>,
        out: &mut [Vec4; N],
    ) {
        let image = &images[self.image as usize];
        let view = image.view();
        let mut all_small = true;
        for i in 0..N {
            all_small &= coords.footprint(i).is_small(image.width, image.height);
        }
        let lanes = if all_small { None } else { Some(ProbeLanes::new(coords, image)) };
        let interpolated = self.filter == TextureFilter::Linear;
        let x = TexelPairs::new(self.wrap[0], &coords.uv[0], view.width);
        let y = TexelPairs::new(self.wrap[1], &coords.uv[1], view.height);
        let colors = semantics.is_color();
        for i in points {
            // No closures, which would not be compiled with the instructions of the kernel.
            let probes = match &lanes {
                Some(lanes) => lanes.get(i),
                None => Probes::NONE,
            };
            if probes.count > 0.0 || !interpolated {
                out[i] = self.sample_probes(image, coords.uv(i), &probes, semantics);
                continue;
            }
            let (xa, xb, fx) = x.at(i, self.wrap[0], view.width);
            let (ya, yb, fy) = y.at(i, self.wrap[1], view.height);
            let (ya, yb) = (ya * view.width as usize, yb * view.width as usize);
            let indices = [ya + xa, ya + xb, yb + xa, yb + xb];
            let decode_first = colors && !self.decode_last;
            let texels = if decode_first { view.decoded_many(indices) } else { view.stored_many(indices) };
            let value = bilerp(texels, [fx, fy]);
            out[i] = match semantics {
                TexelSemantics::Normal => decode_normal(value).extend(0.0),
                _ if colors && self.decode_last => decode_colors(value),
                _ => value,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channels, MipMaps, Texels};

    /// Covers coordinates inside, on edges, far outside and non-finite; point, small and large footprints;
    /// every layout, wrap mode, filter and semantics.
    #[test]
    fn batches_equal_single_lookups() {
        const N: usize = 8;
        let uvs = [0.0, 0.3, 0.999_999_94, 1.0, -0.2, 7.6, -1e9, f32::NAN, f32::INFINITY, 0.5, 0.124, 1.5];
        let steps = [0.0, 1e-4, 0.02, 0.4, f32::NAN];
        let point = |i: usize| {
            let step = |k: usize| Vec2::new(steps[k % 5], -steps[(k / 2) % 5]);
            (Vec2::new(uvs[i % 12], uvs[(i / 5) % 12]), Footprint { dx: step(i), dy: step(i / 3) })
        };
        for channels in [Channels::L, Channels::La, Channels::Rgb, Channels::Rgba] {
            let (width, height) = (7, 5);
            let count = width * height * channels as usize;
            let eight: Vec<u8> = (0..count).map(|i| (i * 89 % 256) as u8).collect();
            let sixteen: Vec<u16> = (0..count).map(|i| (i * 9973 % 65536) as u16).collect();
            for texels in [Texels::U8(eight), Texels::U16(sixteen)] {
                let mips = MipMaps::default();
                let (width, height) = (width as u32, height as u32);
                let images = [Image { name: String::new(), width, height, channels, texels, mips }];
                for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                    for (filter, decode_last) in [
                        (TextureFilter::Linear, false),
                        (TextureFilter::Linear, true),
                        (TextureFilter::Nearest, false),
                    ] {
                        let texture = Texture { image: 0, wrap: [wrap, Wrap::Repeat], filter, decode_last };
                        for semantics in [
                            TexelSemantics::Color,
                            TexelSemantics::AlphaWeightedColor,
                            TexelSemantics::Data,
                            TexelSemantics::Normal,
                        ] {
                            for first in (0..120).step_by(N) {
                                let mut coords = SampleCoords::<N>::ORIGIN;
                                (0..N).for_each(|i| coords.set(i, point(first + i).0, point(first + i).1));
                                let mut batch = [Vec4::ZERO; N];
                                let points = first / N % 2..N - first % 3;
                                texture.sample_batch(&images, &coords, semantics, points.clone(), &mut batch);
                                for i in points {
                                    let sampled = batch[i];
                                    let (uv, footprint) = point(first + i);
                                    let single = texture.sample_filtered(&images, uv, &footprint, semantics);
                                    // Compares as text, because NaN differs from itself.
                                    assert_eq!(
                                        format!("{sampled:?}"),
                                        format!("{single:?}"),
                                        "{uv} {footprint:?}"
                                    );
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
