//! Where pixels are sampled.

use glam::UVec2;

use super::{RenderSettings, filter};
use crate::accel::{Accel, Columnwise};
use crate::integrator::{LowDiscrepancy, Sample};

/// How the pixels of a picture are sampled.
pub(super) struct Sampling<'a> {
    settings: &'a RenderSettings,
    pub sampler: LowDiscrepancy,
    filter: filter::Prepared,
    /// What of the film a sample stands for.
    size: [f64; 2],
}

impl Sampling<'_> {
    pub fn of(settings: &RenderSettings) -> Sampling<'_> {
        let filter = settings.filter.prepare();
        Sampling {
            settings,
            sampler: LowDiscrepancy { seed: settings.seed, count: settings.samples },
            size: film_per_sample(settings, filter.width()),
            filter,
        }
    }

    /// Samples of every pixel.
    pub fn count(&self) -> usize {
        self.settings.samples.max(1) as usize
    }

    /// Two places on the film, x and y, that all samples of `pixels` lie between.
    pub fn film_of(&self, pixels: &[UVec2]) -> [[f64; 2]; 2] {
        let (first, last) = pixels.iter().fold((UVec2::MAX, UVec2::MIN), |a, p| (a.0.min(*p), a.1.max(*p)));
        let radius = self.settings.filter.radius();
        let at = |pixel: UVec2, offset: f64| self.settings.sample(pixel, 0, (offset, offset));
        let (low, high) = (at(first, 0.5 - radius), at(last, 0.5 + radius));
        // Pixels count downward.
        [[low.x, high.y], [high.x, low.y]]
    }

    /// Puts the samples of `pixels` into `out`, each pixel's by their index, in place of what it held.
    pub fn samples(&self, accel: &Accel, pixels: &[UVec2], out: &mut Vec<Sample>) {
        out.clear();
        out.reserve(pixels.len() * self.count());
        if self.count() == 1 {
            let centre = |&pixel: &UVec2| self.settings.sample(pixel, 0, (0.5, 0.5));
            out.extend(pixels.iter().map(|pixel| Sample { size: self.size, ..centre(pixel) }));
        } else {
            accel.columnwise(Places { sampling: self, pixels, out });
        }
    }
}

/// Width and height of the film that one of a pixel's samples stands for: of the filter, which is so
/// many pixels wide, its share.
fn film_per_sample(settings: &RenderSettings, filter_width: f64) -> [f64; 2] {
    let side = filter_width / f64::from(settings.samples.max(1)).sqrt();
    [side / f64::from(settings.width), side / f64::from(settings.height)]
}

/// Samples that are placed at once.
const LANES: usize = 32;

/// [`Sampling::samples`].
struct Places<'a, 'b> {
    sampling: &'a Sampling<'b>,
    pixels: &'a [UVec2],
    out: &'a mut Vec<Sample>,
}

impl Columnwise for Places<'_, '_> {
    #[inline(always)]
    fn run(self) {
        let Places { sampling: &Sampling { settings, sampler, ref filter, size }, pixels, out } = self;
        let count = settings.samples;
        let mut all = pixels.iter().flat_map(|&pixel| {
            let flips = sampler.flips(pixel);
            (0..count).map(move |index| (pixel, flips, index))
        });
        let (mut pixel, mut flips, mut index) = ([UVec2::ZERO; LANES], [0; LANES], [0; LANES]);
        let mut left = pixels.len() * count as usize;
        while left > 0 {
            let some = left.min(LANES);
            for (i, of) in all.by_ref().take(some).enumerate() {
                (pixel[i], flips[i], index[i]) = of;
            }
            let places = sampler.on_film(&flips, &index);
            let mut at = [[0.0; LANES]; 2];
            for (to, from) in at.as_flattened_mut().iter_mut().zip(places.as_flattened()) {
                *to = filter.offset(*from);
            }
            for i in 0..LANES {
                let offset = (0.5 + at[0][i], 0.5 + at[1][i]);
                let Sample { x, y, .. } = settings.sample(pixel[i], index[i], offset);
                (at[0][i], at[1][i]) = (x, y);
            }
            for i in 0..some {
                let (x, y) = (at[0][i], at[1][i]);
                out.push(Sample { x, y, pixel: pixel[i], index: index[i], size });
            }
            left -= some;
        }
    }
}
