//! The frames that lead to a picture: first a coarse one that comes soon, then better ones.

use super::frame::Quality;
use super::messages::ViewMessage;

/// Time for the pixels of a coarse frame, in seconds: with the rest of the way, it comes within 150 ms.
const COARSE_SECONDS: f64 = 0.06;
/// A better frame that takes no longer comes at once.
const SOON_SECONDS: f64 = 0.12;
/// Shorter side of the smallest frame in pixels.
const LEAST_SIDE: f64 = 48.0;
/// Largest factor by which coarse frames are smaller.
const MAX_REDUCTION: f64 = 16.0;

/// The next frame of a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NextFrame {
    /// The first, as good as comes soon. `is_only` if others follow only for other states.
    First {
        is_only: bool,
    },
    /// One sample for each pixel.
    Draft,
    Final,
}

impl NextFrame {
    /// The first frame of a state.
    pub fn first_of(message: &ViewMessage) -> NextFrame {
        NextFrame::First { is_only: message.moving }
    }

    /// True if a worse frame of the same state was sent.
    pub fn is_refinement(self) -> bool {
        !matches!(self, NextFrame::First { .. })
    }

    /// Size and samples of the frame. `cost` is the time for a sample of a pixel in seconds.
    pub fn quality(self, size: (u32, u32), samples: u32, cost: f64) -> Quality {
        let pixels = f64::from(size.0) * f64::from(size.1);
        let is_only = match self {
            NextFrame::Final => return Quality::Final,
            NextFrame::Draft => return Quality::Draft,
            NextFrame::First { is_only } => is_only,
        };
        if !is_only && pixels * f64::from(samples) * cost <= SOON_SECONDS {
            return Quality::Final;
        }
        if pixels * cost <= COARSE_SECONDS {
            return Quality::Draft;
        }
        let shorter = f64::from(size.0.min(size.1));
        let largest = MAX_REDUCTION.min(shorter / LEAST_SIDE).max(1.0);
        let reduction = (pixels * cost / COARSE_SECONDS).sqrt().clamp(1.0, largest);
        let side = |pixels: u32| (f64::from(pixels) / reduction).round().max(1.0) as u32;
        Quality::Coarse { width: side(size.0), height: side(size.1) }
    }

    /// The frame after one of this quality.
    pub fn after(self, quality: Quality, samples: u32) -> Option<NextFrame> {
        let is_only = self == NextFrame::First { is_only: true };
        match quality {
            _ if is_only => None,
            Quality::Final => None,
            Quality::Coarse { .. } if samples > 1 => Some(NextFrame::Draft),
            _ => Some(NextFrame::Final),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (u32, u32) = (1280, 720);

    #[test]
    fn frames_get_better_until_the_last() {
        for (cost, samples, expected) in
            [(1e-6, 16, 3), (1e-6, 1, 2), (1e-8, 16, 2), (1e-9, 16, 1), (1.0, 64, 3)]
        {
            let mut next = Some(NextFrame::First { is_only: false });
            let mut qualities = Vec::new();
            while let Some(frame) = next {
                let quality = frame.quality(SIZE, samples, cost);
                qualities.push(quality);
                next = frame.after(quality, samples);
            }
            assert_eq!(qualities.len(), expected, "{qualities:?}");
            assert_eq!(qualities.last(), Some(&Quality::Final));
        }
    }

    #[test]
    fn coarse_frames_keep_their_time_and_their_shape() {
        for cost in [1e-7, 1e-6, 1e-5] {
            let first = NextFrame::First { is_only: true };
            let size = match first.quality(SIZE, 16, cost) {
                Quality::Coarse { width, height } => (width, height),
                _ => SIZE,
            };
            let seconds = f64::from(size.0) * f64::from(size.1) * cost;
            assert!(seconds < 1.05 * COARSE_SECONDS, "{size:?}");
            let aspect = f64::from(size.0) / f64::from(size.1);
            assert!((aspect - 16.0 / 9.0).abs() < 0.03, "{size:?}");
            assert_eq!(first.after(Quality::Draft, 16), None);
        }
        // Slow or small pictures stay recognisable.
        for (size, cost) in [((1280, 720), 1.0), ((40, 30), 1.0), ((1, 1), 1.0)] {
            let Quality::Coarse { width, height } =
                (NextFrame::First { is_only: true }).quality(size, 4, cost)
            else {
                panic!("{size:?}")
            };
            assert!(width.min(height) >= size.0.min(size.1).min(45), "{width} {height}");
        }
    }
}
