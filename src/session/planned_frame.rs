//! One image of a sequence.

use blinn_scene::{SampledView, Scene};

/// Frames per second where neither the user nor the file gives them.
pub const DEFAULT_FPS: f64 = 24.0;

/// One image of a scene.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PlannedFrame {
    /// Its number.
    pub number: i64,
    /// Time in the animation, in seconds.
    pub time: f64,
    /// The rate that the time assumes.
    pub rate: FrameRate,
    /// Rotation of a turntable, in radians.
    pub angle: f64,
    /// Camera and light in a dataset.
    pub view: Option<SampledView>,
    /// Index in a list of cameras.
    pub camera: Option<usize>,
}

/// The frame rate that the time of a frame assumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum FrameRate {
    /// A given one; the time is exact.
    Given,
    /// [`DEFAULT_FPS`], unless the file has another.
    File,
}

impl PlannedFrame {
    /// A frame at a time, without rotation.
    pub fn at(number: i64, time: f64) -> PlannedFrame {
        PlannedFrame { number, time, rate: FrameRate::Given, angle: 0.0, view: None, camera: None }
    }

    /// The frame `position`, which need not be whole, at the rate of the file.
    pub fn at_file_rate(position: f64) -> PlannedFrame {
        PlannedFrame { rate: FrameRate::File, ..PlannedFrame::at(position as i64, position / DEFAULT_FPS) }
    }

    /// The frame at its time in a scene.
    pub fn in_scene(self, scene: &Scene) -> PlannedFrame {
        let Some(frames) = scene.settings.frames.filter(|_| self.rate == FrameRate::File) else {
            return self;
        };
        let position = self.time * DEFAULT_FPS;
        // Whole frames have exactly the time of the file's.
        let number = self.number as f64;
        let position = if (position - number).abs() < 1e-9 { number } else { position };
        PlannedFrame { time: position / frames.rate, rate: FrameRate::Given, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_scene::FileFrames;

    #[test]
    fn frames_without_a_rate_have_that_of_the_file() {
        let mut scene = Scene::default();
        assert_eq!(PlannedFrame::at_file_rate(7.0).in_scene(&scene).time, 7.0 / 24.0);
        scene.settings.frames = Some(FileFrames { start: 1, end: 9, step: 1, rate: 30.0 });
        assert_eq!(PlannedFrame::at_file_rate(7.0).in_scene(&scene), PlannedFrame::at(7, 7.0 / 30.0));
        assert_eq!(PlannedFrame::at_file_rate(-7.0).in_scene(&scene), PlannedFrame::at(-7, -7.0 / 30.0));
        assert!((PlannedFrame::at_file_rate(7.5).in_scene(&scene).time - 7.5 / 30.0).abs() < 1e-12);
        assert_eq!(PlannedFrame::at(7, 0.5).in_scene(&scene), PlannedFrame::at(7, 0.5));
    }
}
