//! Where pixels are sampled.

use glam::UVec2;

use super::{RenderSettings, filter};
use crate::accel::Accel;
use crate::integrator::{LowDiscrepancySampler, Sample};
use crate::simd::AutovecKernel;

/// How the pixels of a picture are sampled.
pub(super) struct Sampling<'a> {
    settings: &'a RenderSettings,
    pub sampler: LowDiscrepancySampler,
    filter: filter::FilterSampler,
    /// What of the film a pixel is: quotients take long.
    per_film: [f64; 2],
    /// What of the film a sample stands for.
    size: [f64; 2],
}

impl Sampling<'_> {
    pub fn of(settings: &RenderSettings) -> Sampling<'_> {
        let filter = settings.filter.prepare();
        Sampling {
            settings,
            sampler: LowDiscrepancySampler { seed: settings.seed, count: settings.samples },
            size: film_per_sample(settings, filter.width()),
            filter,
            per_film: [1.0 / f64::from(settings.width), 1.0 / f64::from(settings.height)],
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
        let at = |pixel: UVec2, offset: f64| self.place(pixel, [offset, offset]);
        let ([left, top], [right, bottom]) = (at(first, 0.5 - radius), at(last, 0.5 + radius));
        [[left, bottom], [right, top]]
    }

    /// Where on the film something `offset` pixels from the upper left corner of `pixel` is.
    #[inline(always)]
    fn place(&self, pixel: UVec2, offset: [f64; 2]) -> [f64; 2] {
        let x = (f64::from(pixel.x) + offset[0]) * self.per_film[0];
        // Pixels count downward.
        let down = (f64::from(pixel.y) + offset[1]) * self.per_film[1];
        [x, 1.0 - down]
    }

    /// Puts the samples of `pixels` into `out`, each pixel's by their index, in place of what it held.
    pub fn samples(&self, accel: &Accel, pixels: &[UVec2], out: &mut Vec<Sample>) {
        out.clear();
        out.reserve(pixels.len() * self.count());
        if self.count() == 1 {
            let centre = |&pixel: &UVec2| self.settings.sample(pixel, 0, (0.5, 0.5));
            out.extend(pixels.iter().map(|pixel| Sample { size: self.size, ..centre(pixel) }));
        } else {
            accel.run_autovec(Places { sampling: self, pixels, out });
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

impl AutovecKernel for Places<'_, '_> {
    #[inline(always)]
    fn run(self) {
        let Places { sampling, pixels, out } = self;
        let Sampling { sampler, filter, size, .. } = sampling;
        let count = sampling.settings.samples;
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
                [at[0][i], at[1][i]] = sampling.place(pixel[i], [0.5 + at[0][i], 0.5 + at[1][i]]);
            }
            let sample =
                |i: usize| Sample { x: at[0][i], y: at[1][i], pixel: pixel[i], index: index[i], size: *size };
            out.extend((0..some).map(sample));
            left -= some;
        }
    }
}
