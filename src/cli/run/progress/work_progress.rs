//! How much of all work is done.

use std::time::{Duration, Instant};

/// Progress over all scenes and frames.
///
/// All scenes count the same, and all frames of a scene count the same. The number of frames of a scene may be known only
/// after reading it, and progress never goes back.
#[derive(Debug)]
pub struct WorkProgress {
    since: Instant,
    scenes: usize,
    scenes_done: usize,
    /// Frames of the current scene.
    frames: usize,
    frames_done: usize,
    /// Finished fraction of the current frame, 0 … 1.
    frame_fraction: f64,
    /// Finished frames of all scenes.
    total_frames: usize,
}

/// The number of the current item, from 1, and the number of items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    pub current: usize,
    pub count: usize,
}

impl WorkProgress {
    pub fn new(scenes: usize) -> WorkProgress {
        WorkProgress {
            since: Instant::now(),
            scenes: scenes.max(1),
            scenes_done: 0,
            frames: 1,
            frames_done: 0,
            frame_fraction: 0.0,
            total_frames: 0,
        }
    }

    /// Sets the number of frames of the current scene.
    pub fn begin_frames(&mut self, frames: usize) {
        self.frames = frames.max(1);
        self.frames_done = 0;
        self.frame_fraction = 0.0;
    }

    pub fn set_frame_fraction(&mut self, fraction: f64) {
        self.frame_fraction = fraction;
    }

    pub fn frame_done(&mut self) {
        self.frames_done += 1;
        self.total_frames += 1;
        self.frame_fraction = 0.0;
    }

    /// The current scene is finished or has failed.
    pub fn scene_done(&mut self) {
        self.scenes_done += 1;
        self.begin_frames(1);
    }

    /// The finished fraction of all work, 0 … 1.
    pub fn fraction(&self) -> f64 {
        let of_scene = ((self.frames_done as f64 + self.frame_fraction) / self.frames as f64).min(1.0);
        ((self.scenes_done as f64 + of_scene) / self.scenes as f64).min(1.0)
    }

    /// The current frame of the current scene.
    pub fn frame(&self) -> Position {
        Position { current: (self.frames_done + 1).min(self.frames), count: self.frames }
    }

    /// The current scene.
    pub fn scene(&self) -> Position {
        Position { current: (self.scenes_done + 1).min(self.scenes), count: self.scenes }
    }

    /// The average rate, once there is one.
    pub fn frames_per_second(&self) -> Option<f64> {
        let seconds = self.since.elapsed().as_secs_f64();
        let frames = self.total_frames as f64 + self.frame_fraction;
        (seconds > 0.1 && frames > 0.0).then(|| frames / seconds)
    }

    /// The remaining time at the average rate.
    pub fn time_left(&self) -> Option<Duration> {
        let fraction = self.fraction();
        let left = self.since.elapsed().as_secs_f64() * (1.0 - fraction) / fraction;
        Duration::try_from_secs_f64(left).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_never_goes_back() {
        let mut progress = WorkProgress::new(3);
        let mut last = 0.0;
        let mut check = |progress: &WorkProgress| {
            assert!(progress.fraction() >= last && progress.fraction() <= 1.0);
            last = progress.fraction();
        };
        for frames in [1, 4] {
            progress.begin_frames(frames);
            check(&progress);
            for _ in 0..frames {
                for fraction in [0.3, 0.9] {
                    progress.set_frame_fraction(fraction);
                    check(&progress);
                }
                progress.frame_done();
                check(&progress);
            }
            progress.scene_done();
            check(&progress);
        }
        assert!((progress.fraction() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!((progress.scene(), progress.total_frames), (Position { current: 3, count: 3 }, 5));
        // A scene that fails at once.
        progress.scene_done();
        check(&progress);
        assert_eq!(progress.fraction(), 1.0);
    }
}
