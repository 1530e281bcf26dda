//! Generates the samples of pixels: positions on the film drawn from the pixel filter, and points of the aperture.

use glam::{DVec2, UVec2};

use crate::filter::FilterSampler;
use crate::integrator::{LowDiscrepancySampler, Sample, SampleDimension};
use crate::settings::RenderSettings;
use blinn_core::simd::{AutovecKernel, SimdLevel};
use blinn_scene::ThinLens;

/// Generates the samples of the pixels of a picture.
pub(super) struct SampleGenerator<'a> {
    settings: &'a RenderSettings,
    pub sampler: LowDiscrepancySampler,
    /// The filter; `None` for single samples, which are at the centres of pixels.
    filter: Option<&'static FilterSampler>,
    /// Width and height of a pixel on the film: multiplying by them is faster than dividing.
    pixel_size: [f64; 2],
    /// The part of the film that a sample covers.
    footprint: [f64; 2],
    /// The lens whose aperture samples are spread over; `None`: all pass its centre.
    lens: Option<ThinLens>,
}

impl SampleGenerator<'_> {
    pub fn new(settings: &RenderSettings, lens: Option<ThinLens>) -> SampleGenerator<'_> {
        let is_single = settings.samples <= 1;
        SampleGenerator {
            settings,
            sampler: LowDiscrepancySampler { seed: settings.seed, count: settings.samples },
            footprint: sample_footprint(settings),
            filter: (!is_single).then(|| FilterSampler::of(settings.filter)),
            lens,
            pixel_size: [1.0 / f64::from(settings.width), 1.0 / f64::from(settings.height)],
        }
    }

    pub fn samples_per_pixel(&self) -> usize {
        self.settings.samples.max(1) as usize
    }

    /// Bounds on the film of all samples of `pixels`: the lowest and the highest x and y.
    pub fn film_bounds(&self, pixels: &[UVec2]) -> [[f64; 2]; 2] {
        // Numbers, not vectors, of which baseline x86-64 has no minimum.
        let (mut min, mut max) = (UVec2::MAX, UVec2::MIN);
        for &UVec2 { x, y } in pixels {
            (min.x, min.y) = (min.x.min(x), min.y.min(y));
            (max.x, max.y) = (max.x.max(x), max.y.max(y));
        }
        let radius = self.settings.filter.radius();
        let [left, top] = self.film_position(min, [0.5 - radius; 2]);
        let [right, bottom] = self.film_position(max, [0.5 + radius; 2]);
        [[left, bottom], [right, top]]
    }

    /// The film position of a point `offset` pixels from the upper left corner of `pixel`.
    #[inline(always)]
    fn film_position(&self, pixel: UVec2, offset: [f64; 2]) -> [f64; 2] {
        let x = (f64::from(pixel.x) + offset[0]) * self.pixel_size[0];
        // Pixels count downward, the film upward.
        let down = (f64::from(pixel.y) + offset[1]) * self.pixel_size[1];
        [x, 1.0 - down]
    }

    /// Replaces `out` by the samples of `pixels`: pixel by pixel, in the order of their indices.
    pub fn generate(&self, simd: SimdLevel, pixels: &[UVec2], out: &mut Vec<Sample>) {
        out.clear();
        out.reserve(pixels.len() * self.samples_per_pixel());
        match self.filter {
            Some(filter) => simd.run(GenerateSamples { generator: self, filter, pixels, out }),
            None => {
                let centre =
                    |&pixel| Sample { footprint: self.footprint, ..self.settings.centre_sample(pixel) };
                out.extend(pixels.iter().map(centre));
            }
        }
        if let Some(lens) = self.lens {
            let pair = SampleDimension::Aperture.pair();
            for sample in out {
                sample.aperture = lens.aperture_point(self.sampler.get_2d(sample.pixel, sample.index, pair));
            }
        }
    }
}

/// Width and height on the film that one sample covers: the filter's area divided by the number of samples.
fn sample_footprint(settings: &RenderSettings) -> [f64; 2] {
    let side = settings.filter.width() / f64::from(settings.samples.max(1)).sqrt();
    [side / f64::from(settings.width), side / f64::from(settings.height)]
}

/// Samples that are generated at once.
const LANES: usize = 32;

/// Generates several samples per pixel.
struct GenerateSamples<'a, 'b> {
    generator: &'a SampleGenerator<'b>,
    filter: &'a FilterSampler,
    pixels: &'a [UVec2],
    out: &'a mut Vec<Sample>,
}

impl AutovecKernel for GenerateSamples<'_, '_> {
    #[inline(always)]
    fn run(self) {
        let GenerateSamples { generator, filter, pixels, out } = self;
        let SampleGenerator { sampler, footprint, .. } = generator;
        let count = generator.settings.samples;
        let mut samples = pixels.iter().flat_map(|&pixel| {
            let scramble = sampler.film_scramble(pixel);
            (0..count).map(move |index| (pixel, scramble, index))
        });
        let mut pixel = [UVec2::ZERO; LANES];
        let mut scramble = [0; LANES];
        let mut index = [0; LANES];
        let mut remaining = pixels.len() * count as usize;
        while remaining > 0 {
            let lanes = remaining.min(LANES);
            for (i, sample) in samples.by_ref().take(lanes).enumerate() {
                (pixel[i], scramble[i], index[i]) = sample;
            }
            let random = sampler.film_positions(&scramble, &index);
            let mut position = [[0.0; LANES]; 2];
            for (to, from) in position.as_flattened_mut().iter_mut().zip(random.as_flattened()) {
                *to = filter.offset(*from);
            }
            for i in 0..LANES {
                [position[0][i], position[1][i]] =
                    generator.film_position(pixel[i], [0.5 + position[0][i], 0.5 + position[1][i]]);
            }
            out.extend((0..lanes).map(|i| Sample {
                x: position[0][i],
                y: position[1][i],
                pixel: pixel[i],
                index: index[i],
                footprint: *footprint,
                aperture: DVec2::ZERO,
            }));
            remaining -= lanes;
        }
    }
}
