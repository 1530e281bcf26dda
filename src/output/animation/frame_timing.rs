//! When frames begin, in the ticks of a format.

/// Frames a second, in a format that counts whole ticks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameTiming {
    pub fps: f64,
    /// Ticks a second.
    pub ticks: f64,
}

impl FrameTiming {
    /// Ticks that frame `index` is shown for. What one frame is rounded by the next makes up for: any
    /// number of frames lasts as long as it should, to half a tick.
    pub fn delay(self, index: u64) -> u64 {
        let begin = |i: u64| (i as f64 * self.ticks / self.fps).round() as u64;
        begin(index.saturating_add(1)).saturating_sub(begin(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delays_add_up() {
        for fps in [0.5, 7.0, 12.0, 23.976, 24.0, 29.97, 30.0, 50.0, 120.0] {
            for ticks in [100.0, 1000.0] {
                let clock = FrameTiming { fps, ticks };
                let all: u64 = (0..999).map(|i| clock.delay(i)).sum();
                assert!((all as f64 / ticks - 999.0 / fps).abs() <= 0.5 / ticks + 1e-9, "{fps} {ticks}");
            }
        }
    }
}
