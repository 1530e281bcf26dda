//! Frame durations in the ticks of a file format.

/// A frame rate in a format that counts integer ticks.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrameTiming {
    /// Frames per second.
    pub fps: f64,
    pub ticks_per_second: f64,
}

impl FrameTiming {
    /// The duration of frame `index` in ticks. Rounding does not accumulate: any number of frames lasts as long as it
    /// should, to half a tick.
    pub fn delay(self, index: u64) -> u64 {
        let start = |i: u64| (i as f64 * self.ticks_per_second / self.fps).round() as u64;
        start(index.saturating_add(1)).saturating_sub(start(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_does_not_accumulate() {
        for fps in [0.5, 7.0, 12.0, 23.976, 24.0, 29.97, 30.0, 50.0, 120.0] {
            for ticks_per_second in [100.0, 1000.0] {
                let timing = FrameTiming { fps, ticks_per_second };
                let total: u64 = (0..999).map(|i| timing.delay(i)).sum();
                let error = (total as f64 / ticks_per_second - 999.0 / fps).abs();
                assert!(error <= 0.5 / ticks_per_second + 1e-9, "{fps} {ticks_per_second}");
            }
        }
    }
}
