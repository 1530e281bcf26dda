//! How much of all the work is done.

use std::time::{Duration, Instant};

/// Scenes count alike, and frames alike within their scene: how many frames a scene has may be known
/// only once it is read, and what was told never goes back.
#[derive(Debug)]
pub(crate) struct Tally {
    since: Instant,
    scenes: usize,
    scenes_done: usize,
    frames: usize,
    frames_done: usize,
    /// Of the frame at work, 0 … 1.
    part: f64,
    /// Frames of all scenes that are done.
    pub all_frames: usize,
}

impl Tally {
    pub fn new(scenes: usize) -> Tally {
        Tally {
            since: Instant::now(),
            scenes: scenes.max(1),
            scenes_done: 0,
            frames: 1,
            frames_done: 0,
            part: 0.0,
            all_frames: 0,
        }
    }

    /// The scene at work has so many frames to make.
    pub fn frames(&mut self, frames: usize) {
        (self.frames, self.frames_done, self.part) = (frames.max(1), 0, 0.0);
    }

    /// So much of the frame at work is done.
    pub fn part(&mut self, part: f64) {
        self.part = part;
    }

    /// The frame at work is done.
    pub fn frame_done(&mut self) {
        self.frames_done += 1;
        self.all_frames += 1;
        self.part = 0.0;
    }

    /// The scene at work is done, or given up.
    pub fn scene_done(&mut self) {
        self.scenes_done += 1;
        self.frames(1);
    }

    /// The share of all work that is done, 0 … 1.
    pub fn done(&self) -> f64 {
        let of_scene = ((self.frames_done as f64 + self.part) / self.frames as f64).min(1.0);
        ((self.scenes_done as f64 + of_scene) / self.scenes as f64).min(1.0)
    }

    /// The frame at work, from 1, and of how many.
    pub fn frame(&self) -> (usize, usize) {
        ((self.frames_done + 1).min(self.frames), self.frames)
    }

    /// The scene at work, from 1, and of how many.
    pub fn scene(&self) -> (usize, usize) {
        ((self.scenes_done + 1).min(self.scenes), self.scenes)
    }

    /// Frames a second, once there are some.
    pub fn rate(&self) -> Option<f64> {
        let seconds = self.since.elapsed().as_secs_f64();
        let frames = self.all_frames as f64 + self.part;
        (seconds > 0.1 && frames > 0.0).then(|| frames / seconds)
    }

    /// The time that the rest takes if it goes on like this.
    pub fn left(&self) -> Option<Duration> {
        let done = self.done();
        let left = self.since.elapsed().as_secs_f64() * (1.0 - done) / done;
        Duration::try_from_secs_f64(left).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_done_never_goes_back() {
        let mut tally = Tally::new(3);
        let mut last = 0.0;
        let mut forward = |tally: &Tally| {
            assert!(tally.done() >= last && tally.done() <= 1.0);
            last = tally.done();
        };
        for frames in [1, 4] {
            tally.frames(frames);
            forward(&tally);
            for _ in 0..frames {
                for part in [0.3, 0.9] {
                    tally.part(part);
                    forward(&tally);
                }
                tally.frame_done();
                forward(&tally);
            }
            tally.scene_done();
            forward(&tally);
        }
        assert!((tally.done() - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!((tally.scene(), tally.all_frames), ((3, 3), 5));
        // One that fails at once.
        tally.scene_done();
        forward(&tally);
        assert_eq!(tally.done(), 1.0);
    }
}
