//! One image of a sequence.

use blinn_scene::SampledView;

/// One image of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedFrame {
    /// Its number.
    pub number: i64,
    /// Time in the animation, in seconds.
    pub time: f64,
    /// Rotation of a turntable, in radians.
    pub angle: f64,
    /// Camera and light in a dataset.
    pub view: Option<SampledView>,
    /// Index in a list of cameras.
    pub camera: Option<usize>,
}

impl PlannedFrame {
    /// A frame at a time, without rotation.
    pub fn at(number: i64, time: f64) -> PlannedFrame {
        PlannedFrame { number, time, angle: 0.0, view: None, camera: None }
    }
}
