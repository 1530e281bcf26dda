//! Facts that all files of a dataset describe: cameras, time, unit of depth and normalization, computed once for a scene.

use crate::camera_list::ImageCamera;
use crate::clip_bounds::log_clip_bounds;
use crate::dataset_plan::DatasetPlan;
use crate::error::SessionError;
use crate::log::SessionLog;
use crate::options::Options;
use crate::plan::SessionPlan;
use crate::planned_frame::PlannedFrame;
use crate::round_sizes::round_sizes;
use blinn_accel::{Accel, RoundSizes};
use blinn_output::datasets::Dataset;
use blinn_scene::{
    Camera, ClipBoundsCache, DEFAULT_BASELINE, DistanceRange, LightRotation, Normalization, PoseSettings,
    PosedScene, SampledView, Scene, StereoEye, clip_duration, pose,
};

/// The scene as all views of a dataset see it.
pub struct DatasetViews<'s> {
    plan: &'s SessionPlan,
    dataset: DatasetPlan,
    posed: PosedScene<'s>,
    size: (u32, u32),
    depth_step: Option<f64>,
    normalization: Option<Normalization>,
}

impl<'s> DatasetViews<'s> {
    /// Poses `scene` for the views of `dataset`.
    ///
    /// # Errors
    /// The options do not suit the scene, or the work was cancelled.
    pub fn new(
        plan: &'s SessionPlan,
        dataset: &DatasetPlan,
        scene: &'s Scene,
        clip_bounds: &ClipBoundsCache,
        log: &dyn SessionLog,
    ) -> Result<DatasetViews<'s>, SessionError> {
        let animation = plan.options.animation(scene)?;
        let time = dataset.time.min(clip_duration(scene, &animation)?);
        let start = pose(scene, &PoseSettings { time: 0.0, animation, centre: None })?
            .with_clip_bounds_cache(clip_bounds);
        log_clip_bounds(log, &start, || start.clip_bounds())?;
        let size = plan.options.size_for(scene);
        let depth_step = depth_step(plan, &start, size)?;
        let normalization = plan.options.normalize.map(|_| plan.options.normalization(&start));
        let posed = start.at_time(time);
        Ok(DatasetViews { plan, dataset: *dataset, posed, size, depth_step, normalization })
    }

    /// The scene at the time of the dataset.
    pub fn posed(&self) -> &PosedScene<'s> {
        &self.posed
    }

    /// All views.
    pub fn frames(&self) -> impl Iterator<Item = PlannedFrame> {
        self.dataset.frames()
    }

    /// Facts that all views share, as files describe them.
    pub fn describe(&self) -> Dataset {
        Dataset {
            size: self.size,
            window: self.plan.options.render_settings(self.size, 0.0).window(),
            up: self.dataset.up,
            time: self.dataset.time,
            bounds: self.posed.bounds(),
            depth_step: self.depth_step,
            normalization: self.normalization,
            sampling: self.dataset.sampling,
        }
    }

    /// The sizes of points and lines in the view of `camera`.
    pub fn round_sizes(&self, accel: &Accel, camera: &Camera) -> RoundSizes {
        let Options { point_size, line_width, .. } = self.plan.options;
        round_sizes(point_size, line_width, accel, camera, self.size.1)
    }

    /// The camera of a view.
    ///
    /// # Errors
    /// The camera does not suit the scene.
    pub fn view(&self, frame: &PlannedFrame) -> Result<ImageCamera, SessionError> {
        Ok(ImageCamera {
            camera: self.plan.options.camera(frame, &self.posed, self.size)?,
            size: self.size,
            crop: self.plan.options.crop,
            depth_step: self.depth_step,
            light: frame.view.map_or(LightRotation::default(), |view| view.light),
            normalization: self.normalization,
        })
    }
}

/// Metres, or units of the normalization, per step of a dataset's 16-bit depth images, so that every point that a view can see
/// has a depth. `None` if there are no such images.
pub(crate) fn depth_step(
    plan: &SessionPlan,
    posed: &PosedScene,
    size: (u32, u32),
) -> Result<Option<f64>, SessionError> {
    if plan.options.depth_unit.is_some() {
        return Ok(plan.options.depth_unit);
    }
    let Some(first) = plan.dataset.and_then(|dataset| dataset.frames().next()) else { return Ok(None) };
    if plan.holds_layers {
        return Ok(None);
    }
    let sphere = posed.clip_sphere();
    let centre = plan.options.view.look_at.unwrap_or(sphere.centre);
    let options = &plan.options;
    let scale = options.normalization(posed).scale;
    let framed = PlannedFrame { view: first.view.map(|view| SampledView::at(view.orbit)), ..first };
    let framed = options.camera(&framed, posed, size)?.view_point.distance(centre);
    let distance = match plan.dataset.and_then(|dataset| dataset.sampling.distance) {
        None => framed,
        Some(DistanceRange::Framed(_, high)) => high * framed,
        Some(DistanceRange::Metres(_, high)) => high / scale,
    };
    let stereo = match first.view.and_then(|view| view.stereo) {
        Some(StereoEye { baseline, .. }) => {
            0.5 * baseline.map_or(DEFAULT_BASELINE * distance, |baseline| baseline / scale)
        }
        None => 0.0,
    };
    let farthest = (distance + stereo + centre.distance(sphere.centre) + sphere.radius) * scale;
    // Three digits, rounded up by at most 1 %, are easy to type.
    let step: f64 = format!("{:.2e}", 1.01 * farthest / f64::from(u16::MAX)).parse().unwrap_or(0.0);
    Ok(Some(if step > 0.0 { step } else { 1.0 }))
}
