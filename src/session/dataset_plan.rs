//! The views of a dataset: from all around a scene, as a training set for NeRF and Gaussian splatting.

use crate::planned_frame::PlannedFrame;
use blinn_output::datasets::WorldUp;
use blinn_scene::{ViewLayout, ViewSampling, icosphere};

/// The views of a dataset.
#[derive(Clone, Copy, Debug)]
pub struct DatasetPlan {
    /// Number of views.
    pub count: u32,
    /// Time of all views in the animation, in seconds.
    pub time: f64,
    /// The up axis of the world that is written.
    pub up: WorldUp,
    /// How the views are chosen.
    pub sampling: ViewSampling,
}

impl DatasetPlan {
    /// All views, also those that --only or --chunk leave out.
    pub fn frames(&self) -> impl Iterator<Item = PlannedFrame> {
        self.views(1..=i64::from(self.count))
    }

    /// The views with these numbers.
    pub fn views(&self, numbers: impl Iterator<Item = i64>) -> impl Iterator<Item = PlannedFrame> {
        let DatasetPlan { count, time, sampling, .. } = *self;
        let is_icosphere = sampling.layout == ViewLayout::Icosphere;
        let positions = if is_icosphere { icosphere(count) } else { Vec::new() };
        numbers.map(move |number| {
            let view = sampling.view(u32::try_from(number - 1).unwrap_or_default(), count, &positions);
            PlannedFrame { view: Some(view), ..PlannedFrame::at(number, time) }
        })
    }
}
