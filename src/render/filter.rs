//! Pixel reconstruction filters, by importance sampling (Ernst, Stamminger and Greiner, “Filter Importance Sampling”, 2006):
//! a sample belongs to one pixel and its offset is drawn from the filter, so that all weights are equal and tiles do not
//! overlap.

use std::sync::OnceLock;

/// A pixel filter, the same along x and y.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum PixelFilter {
    /// One pixel wide, constant.
    Box,
    /// Two pixels wide, falls linearly from the centre.
    Tent,
    /// Standard deviation ½ pixel, three pixels wide.
    Gaussian,
    /// Blackman-Harris window, three pixels wide.
    #[default]
    BlackmanHarris,
}

impl PixelFilter {
    /// Half its width in pixels.
    pub fn radius(self) -> f64 {
        match self {
            PixelFilter::Box => 0.5,
            PixelFilter::Tent => 1.0,
            PixelFilter::Gaussian | PixelFilter::BlackmanHarris => 1.5,
        }
    }

    /// Width in pixels of the box filter with the variance of the offsets that are drawn from it. A constant, as pictures of
    /// one sample per pixel need no table.
    pub fn width(self) -> f64 {
        match self {
            PixelFilter::Box => 0.999_999_523_162_728_1,
            PixelFilter::Tent => 1.414_354_128_988_120_3,
            PixelFilter::Gaussian => 1.660_047_134_463_926_5,
            PixelFilter::BlackmanHarris => 1.441_326_114_088_640_9,
        }
    }

    /// Its value at `x` pixels from the centre, up to a factor.
    fn value(self, x: f64) -> f64 {
        use std::f64::consts::TAU;
        match self {
            PixelFilter::Box => 1.0,
            PixelFilter::Tent => 1.0 - x.abs(),
            PixelFilter::Gaussian => libm::exp(-2.0 * x * x) - libm::exp(-2.0 * 1.5 * 1.5),
            PixelFilter::BlackmanHarris => {
                // cos 2φ and cos 3φ as polynomials of cos φ: the table evaluates this thousands of times.
                let c = libm::cos(TAU * (x / 3.0 + 0.5));
                0.35875 - 0.48829 * c + 0.14128 * (2.0 * c * c - 1.0) - 0.01168 * (4.0 * c * c - 3.0) * c
            }
        }
    }
}

/// Intervals of the tabulated inverse of a filter's integral.
const INTERVALS: usize = 1024;

/// Draws offsets from a filter.
#[derive(Clone, Debug)]
pub struct FilterSampler {
    /// Offsets at equal steps of probability: the inverse of the cumulative distribution.
    inverse_cdf: Box<[f64; INTERVALS + 1]>,
}

impl FilterSampler {
    /// The sampler of a filter, which is tabulated once for all pictures.
    pub fn of(filter: PixelFilter) -> &'static FilterSampler {
        static SAMPLERS: [OnceLock<FilterSampler>; 4] = [const { OnceLock::new() }; 4];
        SAMPLERS[filter as usize].get_or_init(|| FilterSampler::new(filter))
    }

    /// Tabulates the inverse of the filter's integral.
    fn new(filter: PixelFilter) -> FilterSampler {
        let r = filter.radius();
        let steps = 16 * INTERVALS;
        let x = |i: usize| -r + 2.0 * r * i as f64 / steps as f64;
        // The trapezoidal rule is exact enough at this step for all filters.
        let mut cdf = vec![0.0; steps + 1];
        let mut last = filter.value(x(0));
        for i in 0..steps {
            let next = filter.value(x(i + 1));
            cdf[i + 1] = cdf[i] + 0.5 * (last + next);
            last = next;
        }
        let total = cdf[steps];
        let inverse = |k: usize| {
            let target = total * k as f64 / INTERVALS as f64;
            let i = cdf.partition_point(|&v| v < target).clamp(1, steps);
            let (a, b) = (cdf[i - 1], cdf[i]);
            let f = if b > a { (target - a) / (b - a) } else { 0.0 };
            x(i - 1) + f * 2.0 * r / steps as f64
        };
        FilterSampler { inverse_cdf: Box::new(std::array::from_fn(inverse)) }
    }

    /// The offset in pixels from the pixel's centre for a number in 0…1.
    #[inline(always)]
    pub fn offset(&self, u: f32) -> f64 {
        /// At this magnitude f64 has no fraction bits, and the integer is in the lowest bits.
        const ROUND: f64 = 1.5 * (1u64 << 52) as f64;
        let x = f64::from(u) * INTERVALS as f64;
        // The floor without a conversion, which compilers do not vectorise. Integers may round to either side: there both
        // intervals give the same offset.
        let floor = x - 0.5 + ROUND;
        let f = x - (floor - ROUND);
        let i = ((floor.to_bits() as u32) as usize).min(INTERVALS - 1);
        self.inverse_cdf[i] * (1.0 - f) + self.inverse_cdf[i + 1] * f
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Width in pixels of the box filter with the variance of offsets at equal steps of probability.
    fn box_width(offsets: &[f64; INTERVALS + 1]) -> f64 {
        let square = |ends: &[f64]| 0.25 * (ends[0] + ends[1]) * (ends[0] + ends[1]);
        let variance = offsets.windows(2).map(square).sum::<f64>() / INTERVALS as f64;
        (12.0 * variance).sqrt()
    }

    #[test]
    fn width_is_that_of_a_box_of_the_same_variance() {
        // Variances: box 1/12, tent 1/6; the other two by integration.
        let widths = [
            (PixelFilter::Box, 1.0),
            (PixelFilter::Tent, 2f64.sqrt()),
            (PixelFilter::Gaussian, 1.6594),
            (PixelFilter::BlackmanHarris, 1.4394),
        ];
        for (filter, expected) in widths {
            let width = filter.width();
            assert!((width / expected - 1.0).abs() < 2e-3, "{filter:?}: {width}");
            assert_eq!(box_width(&FilterSampler::of(filter).inverse_cdf), width, "{filter:?}");
        }
    }

    #[test]
    fn offsets_are_distributed_as_the_filter() {
        for filter in
            [PixelFilter::Box, PixelFilter::Tent, PixelFilter::Gaussian, PixelFilter::BlackmanHarris]
        {
            let sampler = FilterSampler::of(filter);
            let n = 100_000;
            let r = filter.radius();
            let mut frequencies = [0f64; 12];
            for i in 0..n {
                let x = sampler.offset((i as f32 + 0.5) / n as f32);
                assert!(x.abs() <= r);
                frequencies[((x + r) / (2.0 * r) * 12.0).min(11.0) as usize] += 1.0 / f64::from(n);
            }
            let integral = |bin: usize| {
                let x = |k: usize| -r + 2.0 * r * (bin as f64 + (k as f64 + 0.5) / 100.0) / 12.0;
                (0..100).map(|k| filter.value(x(k))).sum::<f64>()
            };
            let total: f64 = (0..12).map(integral).sum();
            for (bin, frequency) in frequencies.iter().enumerate() {
                assert!((frequency - integral(bin) / total).abs() < 2e-3, "{filter:?} bin {bin}");
            }
        }
    }
}
