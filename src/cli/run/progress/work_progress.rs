//! How much of all work is done.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Progress over all scenes and frames.
///
/// All scenes count the same, and all frames of a scene count the same. The number of frames of a scene may be known only
/// after reading it, several scenes may be rendered at once, and progress never goes back.
#[derive(Debug)]
pub struct WorkProgress {
    since: Instant,
    scenes: usize,
    scenes_done: usize,
    /// The scenes that are being rendered.
    active: Vec<SceneProgress>,
    /// Finished frames of all scenes.
    total_frames: usize,
    /// The largest fraction that was reported.
    reported: f64,
}

/// Progress of a scene that is being rendered.
#[derive(Debug)]
struct SceneProgress {
    scene: PathBuf,
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

impl WorkProgress {
    pub fn new(scenes: usize) -> WorkProgress {
        WorkProgress {
            since: Instant::now(),
            scenes: scenes.max(1),
            scenes_done: 0,
            active: Vec::new(),
            total_frames: 0,
            reported: 0.0,
        }
    }

    /// Sets the number of frames of a scene.
    pub fn begin_frames(&mut self, scene: &Path, frames: usize) {
        let scene = self.scene_mut(scene);
        (scene.frames, scene.frames_done, scene.frame_fraction) = (frames.max(1), 0, 0.0);
    }

    pub fn set_frame_fraction(&mut self, scene: &Path, fraction: f64) {
        self.scene_mut(scene).frame_fraction = fraction;
    }

    pub fn frame_done(&mut self, scene: &Path) {
        let scene = self.scene_mut(scene);
        scene.frames_done += 1;
        scene.frame_fraction = 0.0;
        self.total_frames += 1;
    }

    /// A scene is finished or has failed.
    pub fn scene_done(&mut self, scene: &Path) {
        self.scenes_done += 1;
        if let Some(i) = self.active.iter().position(|active| active.scene == scene) {
            self.active.swap_remove(i);
        }
    }

    /// The finished fraction of all work, 0 … 1.
    pub fn fraction(&mut self) -> f64 {
        let active: f64 = self.active.iter().map(SceneProgress::fraction).sum();
        let done = ((self.scenes_done as f64 + active) / self.scenes as f64).min(1.0);
        self.reported = self.reported.max(done);
        self.reported
    }

    /// The current frame of a scene.
    pub fn frame(&self, scene: &Path) -> Position {
        let active = self.active.iter().find(|active| active.scene == scene);
        active.map_or(Position { current: 1, count: 1 }, |scene| Position {
            current: (scene.frames_done + 1).min(scene.frames),
            count: scene.frames,
        })
    }

    /// The current scene.
    pub fn scene(&self) -> Position {
        Position { current: (self.scenes_done + 1).min(self.scenes), count: self.scenes }
    }

    /// The average rate, once there is one.
    pub fn frames_per_second(&self) -> Option<f64> {
        let seconds = self.since.elapsed().as_secs_f64();
        let unfinished: f64 = self.active.iter().map(|scene| scene.frame_fraction).sum();
        let frames = self.total_frames as f64 + unfinished;
        (seconds > 0.1 && frames > 0.0).then(|| frames / seconds)
    }

    /// The remaining time at the average rate.
    pub fn time_left(&mut self) -> Option<Duration> {
        let fraction = self.fraction();
        let left = self.since.elapsed().as_secs_f64() * (1.0 - fraction) / fraction;
        Duration::try_from_secs_f64(left).ok()
    }

    fn scene_mut(&mut self, scene: &Path) -> &mut SceneProgress {
        let i = self.active.iter().position(|active| active.scene == scene).unwrap_or(self.active.len());
        if i == self.active.len() {
            let scene = scene.to_path_buf();
            self.active.push(SceneProgress { scene, frames: 1, frames_done: 0, frame_fraction: 0.0 });
        }
        &mut self.active[i]
    }
}

impl SceneProgress {
    /// The finished fraction of the scene, 0 … 1.
    fn fraction(&self) -> f64 {
        ((self.frames_done as f64 + self.frame_fraction) / self.frames as f64).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_never_goes_back() {
        let mut progress = WorkProgress::new(3);
        let mut last = 0.0;
        let mut check = |progress: &mut WorkProgress| {
            assert!(progress.fraction() >= last && progress.fraction() <= 1.0);
            last = progress.fraction();
        };
        for (scene, frames) in [("a", 1), ("b", 4)].map(|(scene, frames)| (Path::new(scene), frames)) {
            progress.begin_frames(scene, frames);
            check(&mut progress);
            for _ in 0..frames {
                for fraction in [0.3, 0.9] {
                    progress.set_frame_fraction(scene, fraction);
                    check(&mut progress);
                }
                progress.frame_done(scene);
                check(&mut progress);
            }
            progress.scene_done(scene);
            check(&mut progress);
        }
        assert!((progress.fraction() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!((progress.scene(), progress.total_frames), (Position { current: 3, count: 3 }, 5));
        // A scene that fails at once.
        progress.scene_done(Path::new("c"));
        check(&mut progress);
        assert_eq!(progress.fraction(), 1.0);
    }

    #[test]
    fn scenes_that_are_rendered_at_once_add_up() {
        let (a, b) = (Path::new("a"), Path::new("b"));
        let mut progress = WorkProgress::new(2);
        progress.begin_frames(a, 2);
        progress.frame_done(a);
        progress.begin_frames(b, 4);
        progress.set_frame_fraction(b, 0.5);
        assert_eq!(progress.fraction(), 0.5 * (0.5 + 0.125));
        assert_eq!(progress.frame(a), Position { current: 2, count: 2 });
        assert_eq!(progress.frame(b), Position { current: 1, count: 4 });
        progress.scene_done(b);
        assert_eq!(progress.fraction(), 0.75);
        // The same file again, as a list may name it.
        progress.begin_frames(a, 2);
        assert_eq!(progress.fraction(), 0.75);
    }
}
