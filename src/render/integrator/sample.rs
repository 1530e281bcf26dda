//! Samples of pixels, and the random numbers that belong to each.

use glam::{DVec2, UVec2};

use crate::integrator::sampler::LowDiscrepancySampler;
use blinn_core::simd::{AutovecKernel, SimdLevel};

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
    /// Point of the camera's aperture, in metres to the right and upward from the centre of the lens.
    pub aperture: DVec2,
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
    /// The choice of a glowing triangle.
    EmitterChoice,
    /// The choice of lights behind a diffuse bounce.
    LightChoice,
    /// The direction of a diffuse ray.
    Diffuse,
    /// The choice of diffuse rays that are traced.
    DiffuseRoulette,
    /// A point of the aperture.
    Aperture,
}

impl SampleDimension {
    /// The pair of sampler dimensions of eye rays.
    pub fn pair(self) -> u32 {
        match self {
            SampleDimension::Ambient => 1,
            SampleDimension::Light(i) => 2 + i as u32,
            SampleDimension::Reflection => FIRST_PATH_PAIR,
            SampleDimension::Coat => FIRST_PATH_PAIR + 1,
            SampleDimension::Roulette => FIRST_PATH_PAIR + 2,
            SampleDimension::Diffuse => FIRST_PATH_PAIR + 3,
            SampleDimension::DiffuseRoulette => FIRST_PATH_PAIR + 4,
            SampleDimension::EmitterChoice => FIRST_PATH_PAIR + 5,
            SampleDimension::LightChoice => FIRST_PATH_PAIR + 6,
            SampleDimension::Aperture => FIRST_PATH_PAIR + 7,
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
    #[inline]
    pub fn get_2d_split(&self, path: usize, dimension: SampleDimension, part: u32, parts: u32) -> [f32; 2] {
        let Sample { pixel, index, .. } = self.samples[path];
        let finer = self.finer_sampler(parts);
        let index = index.wrapping_mul(parts).wrapping_add(part);
        finer.get_2d(pixel, index, self.pair(dimension))
    }

    /// The pair of sampler dimensions of this wave.
    pub fn pair(&self, dimension: SampleDimension) -> u32 {
        // A sampler has half as many pairs as it has dimensions.
        dimension.pair().wrapping_add(self.wave.wrapping_mul(WAVE_PAIRS)) & (u32::MAX >> 1)
    }

    /// The position of the first of the `parts` points of a path in the sequences of its sampler. The others follow it.
    /// `None` if the path's sample is not among those of the sampler.
    pub fn sequence_position(&self, path: usize, parts: u32) -> Option<u64> {
        let Sample { pixel, index, .. } = self.samples[path];
        self.finer_sampler(parts).sequence_position(pixel, index.checked_mul(parts)?)
    }

    /// The points of the unit square at the positions of the first `count` lanes in the sequence of a pair of dimensions. `alone`
    /// computes those of samples that are not among the sampler's.
    pub fn points_of_lanes<const N: usize>(
        &self,
        simd: SimdLevel,
        dimension: SampleDimension,
        positions: &[Option<u64>; N],
        count: usize,
        alone: impl Fn(usize) -> [f32; 2],
    ) -> [[f32; N]; 2] {
        let mut points = [[0.0; N]; 2];
        let (sampler, pair) = (self.sampler, self.pair(dimension));
        let positions_or_0 = positions.map(Option::unwrap_or_default);
        simd.run(SequencePoints { sampler, pair, positions: &positions_or_0, points: &mut points });
        for i in (0..count).filter(|&i| positions[i].is_none()) {
            [points[0][i], points[1][i]] = alone(i);
        }
        points
    }

    /// A sampler with `parts` points for each sample.
    fn finer_sampler(&self, parts: u32) -> LowDiscrepancySampler {
        let LowDiscrepancySampler { seed, count } = *self.sampler;
        LowDiscrepancySampler { seed, count: count.max(1).saturating_mul(parts) }
    }
}

/// [`LowDiscrepancySampler::sequence_points`].
struct SequencePoints<'a, const N: usize> {
    sampler: &'a LowDiscrepancySampler,
    pair: u32,
    positions: &'a [u64; N],
    points: &'a mut [[f32; N]; 2],
}

impl<const N: usize> AutovecKernel for SequencePoints<'_, N> {
    #[inline(always)]
    fn run(self) {
        // A copy cannot alias what the loops write.
        let positions = *self.positions;
        *self.points = self.sampler.sequence_points(self.pair, &positions);
    }
}
