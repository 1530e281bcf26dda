//! How much of all work is done.

use std::collections::BTreeMap;
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
    /// The scenes that are worked on, by number.
    current: BTreeMap<usize, SceneProgress>,
    /// Finished frames of all scenes.
    total_frames: usize,
}

/// Progress of a scene.
#[derive(Clone, Copy, Debug)]
struct SceneProgress {
    frames: usize,
    frames_done: usize,
    /// Finished fraction of the current frame, 0 … 1.
    frame_fraction: f64,
}

/// The number of the current item, from 1, and the number of items.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    pub current: usize,
    pub count: usize,
}

impl SceneProgress {
    fn new(frames: usize) -> SceneProgress {
        SceneProgress { frames: frames.max(1), frames_done: 0, frame_fraction: 0.0 }
    }

    /// The finished fraction, 0 … 1.
    fn fraction(&self) -> f64 {
        ((self.frames_done as f64 + self.frame_fraction) / self.frames as f64).min(1.0)
    }
}

impl WorkProgress {
    pub fn new(scenes: usize) -> WorkProgress {
        WorkProgress {
            since: Instant::now(),
            scenes: scenes.max(1),
            scenes_done: 0,
            current: BTreeMap::new(),
            total_frames: 0,
        }
    }

    /// Sets the number of frames of a scene.
    pub fn begin_frames(&mut self, scene: usize, frames: usize) {
        self.current.insert(scene, SceneProgress::new(frames));
    }

    pub fn set_frame_fraction(&mut self, scene: usize, fraction: f64) {
        self.scene_mut(scene).frame_fraction = fraction;
    }

    pub fn frame_done(&mut self, scene: usize) {
        let scene = self.scene_mut(scene);
        scene.frames_done += 1;
        scene.frame_fraction = 0.0;
        self.total_frames += 1;
    }

    /// A scene is finished or has failed.
    pub fn scene_done(&mut self, scene: usize) {
        self.current.remove(&scene);
        self.scenes_done += 1;
    }

    /// The finished fraction of all work, 0 … 1.
    pub fn fraction(&self) -> f64 {
        let current: f64 = self.current.values().map(SceneProgress::fraction).sum();
        ((self.scenes_done as f64 + current) / self.scenes as f64).min(1.0)
    }

    /// The current frame of a scene.
    pub fn frame(&self, scene: usize) -> Position {
        let SceneProgress { frames, frames_done, .. } = self.scene_or_first_frame(scene);
        Position { current: (frames_done + 1).min(frames), count: frames }
    }

    /// The first scene that is not finished.
    pub fn scene(&self) -> Position {
        Position { current: (self.scenes_done + 1).min(self.scenes), count: self.scenes }
    }

    /// The average rate, once there is one.
    pub fn frames_per_second(&self) -> Option<f64> {
        let seconds = self.since.elapsed().as_secs_f64();
        let current: f64 = self.current.values().map(|scene| scene.frame_fraction).sum();
        let frames = self.total_frames as f64 + current;
        (seconds > 0.1 && frames > 0.0).then(|| frames / seconds)
    }

    /// The time since the start.
    pub fn elapsed(&self) -> Duration {
        self.since.elapsed()
    }

    /// The remaining time at the average rate.
    pub fn time_left(&self) -> Option<Duration> {
        let fraction = self.fraction();
        let left = self.since.elapsed().as_secs_f64() * (1.0 - fraction) / fraction;
        Duration::try_from_secs_f64(left).ok()
    }

    fn scene_mut(&mut self, scene: usize) -> &mut SceneProgress {
        self.current.entry(scene).or_insert_with(|| SceneProgress::new(1))
    }

    fn scene_or_first_frame(&self, scene: usize) -> SceneProgress {
        self.current.get(&scene).copied().unwrap_or_else(|| SceneProgress::new(1))
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
        for (scene, frames) in [(1, 1), (2, 4)] {
            progress.begin_frames(scene, frames);
            check(&progress);
            for _ in 0..frames {
                for fraction in [0.3, 0.9] {
                    progress.set_frame_fraction(scene, fraction);
                    check(&progress);
                }
                progress.frame_done(scene);
                check(&progress);
            }
            progress.scene_done(scene);
            check(&progress);
        }
        assert!((progress.fraction() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!((progress.scene(), progress.total_frames), (Position { current: 3, count: 3 }, 5));
        // A scene that fails at once.
        progress.scene_done(3);
        check(&progress);
        assert_eq!(progress.fraction(), 1.0);
    }

    #[test]
    fn scenes_advance_side_by_side() {
        let mut progress = WorkProgress::new(4);
        progress.begin_frames(1, 2);
        progress.begin_frames(2, 4);
        progress.frame_done(2);
        progress.set_frame_fraction(1, 0.5);
        assert_eq!(progress.fraction(), 0.125);
        assert_eq!(progress.frame(2), Position { current: 2, count: 4 });
        assert_eq!(progress.frame(1), Position { current: 1, count: 2 });
        // The second ends first.
        (0..3).for_each(|_| progress.frame_done(2));
        assert_eq!((progress.fraction(), progress.frame(2).current), (0.3125, 4));
        progress.scene_done(1);
        progress.scene_done(2);
        assert_eq!((progress.fraction(), progress.scene().current), (0.5, 3));
    }
}
