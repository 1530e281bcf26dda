//! Reconstruction filters, by importance sampling: a sample belongs to one pixel and its offset
//! is drawn from the filter, so that all weights are equal and tiles never overlap.

/// A filter, the same along x and y.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PixelFilter {
    /// One pixel wide, flat.
    Box,
    /// Two pixels wide, falling linearly from the centre.
    Tent,
    /// Standard deviation ½ pixel, three pixels wide.
    Gaussian,
    /// Blackman-Harris's window, three pixels wide.
    #[default]
    BlackmanHarris,
}

/// Points of the inverse of a filter's integral.
const STEPS: usize = 1024;

/// A filter ready to be drawn from.
#[derive(Clone, Debug)]
pub struct FilterSampler {
    /// Offsets at equal steps of probability.
    inverse: Box<[f64; STEPS + 1]>,
}

impl PixelFilter {
    /// Half its width, in pixels.
    pub fn radius(self) -> f64 {
        match self {
            PixelFilter::Box => 0.5,
            PixelFilter::Tent => 1.0,
            PixelFilter::Gaussian | PixelFilter::BlackmanHarris => 1.5,
        }
    }

    /// Its height at `x` pixels from the centre, up to a factor.
    fn value(self, x: f64) -> f64 {
        use std::f64::consts::TAU;
        match self {
            PixelFilter::Box => 1.0,
            PixelFilter::Tent => 1.0 - x.abs(),
            PixelFilter::Gaussian => libm::exp(-2.0 * x * x) - libm::exp(-2.0 * 1.5 * 1.5),
            PixelFilter::BlackmanHarris => {
                // Twice and three times the angle by its cosine alone, for a table takes thousands.
                let c = libm::cos(TAU * (x / 3.0 + 0.5));
                0.35875 - 0.48829 * c + 0.14128 * (2.0 * c * c - 1.0) - 0.01168 * (4.0 * c * c - 3.0) * c
            }
        }
    }

    /// Tabulates the inverse of its integral.
    pub fn prepare(self) -> FilterSampler {
        let r = self.radius();
        let fine = 16 * STEPS;
        let at = |i: usize| -r + 2.0 * r * i as f64 / fine as f64;
        // Trapezoids; exact enough at this step for every filter here.
        let mut integral = vec![0.0; fine + 1];
        let mut last = self.value(at(0));
        for i in 0..fine {
            let next = self.value(at(i + 1));
            integral[i + 1] = integral[i] + 0.5 * (last + next);
            last = next;
        }
        let total = integral[fine];
        let inverse = |k: usize| {
            let wanted = total * k as f64 / STEPS as f64;
            let i = integral.partition_point(|&v| v < wanted).clamp(1, fine);
            let (a, b) = (integral[i - 1], integral[i]);
            let f = if b > a { (wanted - a) / (b - a) } else { 0.0 };
            at(i - 1) + f * 2.0 * r / fine as f64
        };
        FilterSampler { inverse: Box::new(std::array::from_fn(inverse)) }
    }
}

impl FilterSampler {
    /// Width in pixels of the box that spreads as far: of the same variance.
    pub fn width(&self) -> f64 {
        let square = |ends: &[f64]| 0.25 * (ends[0] + ends[1]) * (ends[0] + ends[1]);
        let variance = self.inverse.windows(2).map(square).sum::<f64>() / STEPS as f64;
        (12.0 * variance).sqrt()
    }

    /// The offset in pixels from the pixel's centre for a number in 0…1.
    #[inline(always)]
    pub fn offset(&self, u: f32) -> f64 {
        /// What is added to this has no digits after the point left, and those before it are the last bits.
        const WHOLE: f64 = 1.5 * (1u64 << 52) as f64;
        let x = f64::from(u) * STEPS as f64;
        // Down to a whole number, without the conversion, which compilers do one at a time. On a whole number
        // either side will do.
        let whole = x - 0.5 + WHOLE;
        let f = x - (whole - WHOLE);
        let i = ((whole.to_bits() as u32) as usize).min(STEPS - 1);
        self.inverse[i] * (1.0 - f) + self.inverse[i + 1] * f
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_is_as_wide_as_a_box_of_its_variance() {
        // The variances of a box, 1/12, and of a tent, 1/6; the other two by their integrals.
        let wide = [
            (PixelFilter::Box, 1.0),
            (PixelFilter::Tent, 2f64.sqrt()),
            (PixelFilter::Gaussian, 1.6594),
            (PixelFilter::BlackmanHarris, 1.4394),
        ];
        for (filter, expected) in wide {
            let width = filter.prepare().width();
            assert!((width / expected - 1.0).abs() < 2e-3, "{filter:?}: {width}");
        }
    }

    #[test]
    fn offsets_are_distributed_as_the_filter() {
        for filter in
            [PixelFilter::Box, PixelFilter::Tent, PixelFilter::Gaussian, PixelFilter::BlackmanHarris]
        {
            let prepared = filter.prepare();
            let n = 100_000;
            let r = filter.radius();
            let mut counts = [0f64; 12];
            for i in 0..n {
                let x = prepared.offset((i as f32 + 0.5) / n as f32);
                assert!(x.abs() <= r);
                counts[((x + r) / (2.0 * r) * 12.0).min(11.0) as usize] += 1.0 / f64::from(n);
            }
            let fine = |i: usize| {
                let at = |k: usize| -r + 2.0 * r * (i as f64 + (k as f64 + 0.5) / 100.0) / 12.0;
                (0..100).map(|k| filter.value(at(k))).sum::<f64>()
            };
            let total: f64 = (0..12).map(fine).sum();
            for (i, count) in counts.iter().enumerate() {
                assert!((count - fine(i) / total).abs() < 2e-3, "{filter:?} bin {i}");
            }
        }
    }
}
