//! Noisy means of a part of the light.

use blinn_core::geometry::Rgb;

/// A part of the light of a picture, divided by its surface colour, in linear light of any range.
#[derive(Clone, Debug, Default)]
pub struct NoisyPart {
    /// Means of the even and of the odd samples of each pixel, row by row from the top.
    pub halves: [Vec<Rgb>; 2],
    /// How far each pixel counts for its neighbours, 0–1: less than 1 where the colour that the part was divided by is
    /// nearly black.
    pub reliability: Vec<f32>,
}

impl NoisyPart {
    pub(super) fn check_len(&self, pixels: usize) {
        let lengths = [self.halves[0].len(), self.halves[1].len(), self.reliability.len()];
        assert!(lengths.iter().all(|n| *n == pixels), "a part of {lengths:?} pixels, expected {pixels}");
    }

    /// Shares of the halves in the mean of all samples.
    pub(super) fn shares(samples: u32) -> [f32; 2] {
        let odd = (samples / 2) as f32 / samples.max(1) as f32;
        [1.0 - odd, odd]
    }

    /// Returns the mean of all samples, the same bits as the halves' where they are equal.
    pub(super) fn mean(&self, samples: u32) -> Vec<Rgb> {
        let [_, odd] = NoisyPart::shares(samples);
        self.halves[0].iter().zip(&self.halves[1]).map(|(a, b)| mean_of_halves(*a, *b, odd)).collect()
    }
}

/// Returns the mean of all samples of a pixel, of which `odd` is the share of the second half.
pub(super) fn mean_of_halves(even: Rgb, odd_half: Rgb, odd: f32) -> Rgb {
    // Infinities of the same sign stay.
    if odd == 0.0 || even == odd_half { even } else { even + (odd_half - even) * odd }
}
