//! Samples of pixels, and the random numbers that belong to each.

use glam::UVec2;

use crate::integrator::sampler::{LowDiscrepancySampler, Sampler};

/// A sample of a pixel at a position on the film: x to the right and y upward, both 0…1 over the whole picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Position to the right.
    pub x: f64,
    /// Position upward.
    pub y: f64,
    /// The pixel, counted from the upper left corner of the whole picture.
    pub pixel: UVec2,
    /// Index among the pixel's samples.
    pub index: u32,
    /// Width and height of the part of the film that the sample covers, over which textures and highlights are filtered.
    /// 0 for a point.
    pub footprint: [f64; 2],
}

/// The uses of random numbers. Each use has a pair of sampler dimensions of its own; the first pair is the
/// position on the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SampleDimension {
    /// Directions of ambient light.
    Ambient,
    /// A point on the light of that index.
    Light(usize),
    /// The direction of a reflected or refracted ray.
    Reflection,
    /// The direction of a ray that a clear coat reflects.
    Coat,
    /// The choice of weak rays that are traced.
    Roulette,
}

impl SampleDimension {
    fn pair(self) -> u32 {
        match self {
            SampleDimension::Ambient => 1,
            SampleDimension::Light(i) => 2 + i as u32,
            SampleDimension::Reflection => FIRST_PATH_PAIR,
            SampleDimension::Coat => FIRST_PATH_PAIR + 1,
            SampleDimension::Roulette => FIRST_PATH_PAIR + 2,
        }
    }
}

/// The first pair of dimensions of secondary rays, behind those of lights.
const FIRST_PATH_PAIR: u32 = 1 << 28;
/// Distance between the pairs of dimensions of two waves of rays.
const WAVE_PAIRS: u32 = 0x9e37_79b1;

/// The random numbers of the paths of a tile.
#[derive(Clone, Copy)]
pub(crate) struct SampleStream<'a> {
    /// The sample of each path.
    pub samples: &'a [Sample],
    pub sampler: &'a LowDiscrepancySampler,
    /// 0 for eye rays, one more for each bounce. Each wave has sampler dimensions of its own.
    pub wave: u32,
}

impl SampleStream<'_> {
    /// A point of the unit square for the path of index `path`.
    pub fn get_2d(&self, path: usize, dimension: SampleDimension) -> [f32; 2] {
        self.get_2d_split(path, dimension, 0, 1)
    }

    /// Point number `part` of the `parts` points of a path. All points of a pixel form one point set of count × parts
    /// points.
    pub fn get_2d_split(&self, path: usize, dimension: SampleDimension, part: u32, parts: u32) -> [f32; 2] {
        let Sample { pixel, index, .. } = self.samples[path];
        let LowDiscrepancySampler { seed, count } = *self.sampler;
        let finer = LowDiscrepancySampler { seed, count: count.max(1).saturating_mul(parts) };
        let index = index.wrapping_mul(parts).wrapping_add(part);
        let first = dimension.pair().wrapping_add(self.wave.wrapping_mul(WAVE_PAIRS)).wrapping_mul(2);
        [finer.get(pixel, index, first), finer.get(pixel, index, first + 1)]
    }
}
