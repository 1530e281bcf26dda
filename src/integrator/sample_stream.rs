//! The random numbers of a tile, each with its own purpose.

use crate::integrator::{LowDiscrepancySampler, Sample, Sampler};

/// What numbers are drawn for; each purpose has a pair of dimensions of its own. The first pair is
/// the place on the film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Directions that ambient light comes from.
    Ambient,
    /// A place on the light of this index.
    Light(usize),
}

impl Purpose {
    fn pair(self) -> u32 {
        match self {
            Purpose::Ambient => 1,
            Purpose::Light(i) => 2 + i as u32,
        }
    }
}

/// Draws numbers for the samples of a tile.
#[derive(Clone, Copy)]
pub(crate) struct Draws<'a> {
    pub samples: &'a [Sample],
    pub sampler: &'a LowDiscrepancySampler,
}

impl Draws<'_> {
    /// A point of the unit square for a sample.
    pub fn one(&self, sample: usize, purpose: Purpose) -> [f32; 2] {
        self.part(sample, purpose, 0, 1)
    }

    /// A point for one of the `parts` that a sample is divided into. All parts of a pixel's samples
    /// are spread as evenly as so many samples would be.
    pub fn part(&self, sample: usize, purpose: Purpose, part: u32, parts: u32) -> [f32; 2] {
        let Sample { pixel, index, .. } = self.samples[sample];
        let LowDiscrepancySampler { seed, count } = *self.sampler;
        let finer = LowDiscrepancySampler { seed, count: count.max(1).saturating_mul(parts) };
        let index = index.wrapping_mul(parts).wrapping_add(part);
        let first = 2 * purpose.pair();
        [finer.get(pixel, index, first), finer.get(pixel, index, first + 1)]
    }
}
