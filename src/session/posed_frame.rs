//! A scene at one time with its acceleration structure, and what is needed to trace rays in it.

use std::sync::Arc;
use std::time::Instant;

use glam::DAffine3;

use crate::error::SessionError;
use crate::framing::Framing;
use crate::log::SessionLog;
use crate::notice::Notice;
use crate::options::{BackFaceCulling, Options, TurntableRotation};
use crate::plan::SessionPlan;
use crate::round_sizes::{round_sizes, solid_sizes};
use blinn_accel::{Accel, AccelSettings, BuildReport, RoundSizes};
use blinn_core::cancellation::CancelToken;
use blinn_render::integrator::{Emitters, Frame};
use blinn_scene::{AxisRotation, Camera, Lighting, PosedScene, ResolvedLighting};

/// A scene at one time.
pub struct PosedFrame<'s> {
    /// In seconds, at most the end of the clip.
    pub time: f64,
    /// The scene at that time.
    pub posed: PosedScene<'s>,
    /// `None` until it is needed.
    pub accel: Option<Accel>,
}

/// Camera framing, lighting and options that all frames of a scene share.
pub struct SceneSetup<'a> {
    /// Options and cameras.
    pub plan: Arc<SessionPlan>,
    /// Receives warnings and times.
    pub log: &'a dyn SessionLog,
    /// How BVHs are built.
    pub build: AccelSettings,
    /// Ends the work on the scene.
    pub cancel: CancelToken,
    /// End of the clip in seconds. The last pose holds from there on.
    pub clip_duration: f64,
    /// View, ground and distances.
    pub framing: Framing,
    /// Light sources and ambient colour are those at the start of the clip.
    pub lighting: Lighting,
    /// The blur of the environment that images show as their background, if they do.
    pub background_blur: Option<f32>,
    /// Scale of the colours of unlit materials.
    pub unlit_scale: f32,
}

impl SceneSetup<'_> {
    /// True if `frame` shows the scene at `time`.
    pub fn is_at(&self, frame: &PosedFrame, time: f64) -> bool {
        frame.time == time.min(self.clip_duration)
    }

    /// Poses the scene at `time`, starting from another frame. Refits `reusable`, the acceleration structure of a
    /// finished frame, or builds a new one.
    pub fn pose_at<'s>(
        &self,
        time: f64,
        other: &PosedFrame<'s>,
        reusable: Option<Accel>,
    ) -> Result<PosedFrame<'s>, SessionError> {
        self.cancel.check()?;
        let time = time.min(self.clip_duration);
        let start = Instant::now();
        let posed = other.posed.at_time(time);
        self.log.stage_since("pose", start, "");
        let mut frame = PosedFrame { time, posed, accel: None };
        match reusable {
            Some(mut accel) => {
                let start = Instant::now();
                let report = accel.update_cancellable(&frame.posed, &self.cancel)?;
                frame.accel = Some(accel);
                self.log_build("update", start, &report)?;
            }
            None => self.build(&mut frame)?,
        }
        Ok(frame)
    }

    /// The scene at `time` with its acceleration structure, starting from the first frame.
    pub fn frame_at<'s>(&self, time: f64, mut start: PosedFrame<'s>) -> Result<PosedFrame<'s>, SessionError> {
        if self.is_at(&start, time) {
            self.build(&mut start)?;
            return Ok(start);
        }
        let reusable = start.accel.take();
        self.pose_at(time, &start, reusable)
    }

    /// Builds the acceleration structure if the frame has none.
    pub fn build(&self, frame: &mut PosedFrame) -> Result<(), SessionError> {
        if frame.accel.is_some() {
            return Ok(());
        }
        let start = Instant::now();
        let (mut accel, report) = Accel::build_cancellable(&frame.posed, &self.build, &self.cancel)?;
        let Options { point_size, line_width, .. } = self.plan.options;
        accel.set_solid_rounds(solid_sizes(point_size, line_width));
        frame.accel = Some(accel);
        self.log_build("build", start, &report)
    }

    fn log_build(&self, stage: &str, start: Instant, report: &BuildReport) -> Result<(), SessionError> {
        let zero_area = match report.zero_area {
            0 => String::new(),
            count => format!("{count} triangles without area"),
        };
        self.log.stage_since(stage, start, &zero_area);
        ignored_primitives(report).try_for_each(|notice| self.log.warn(notice))
    }

    /// The frame as `camera` sees it, without ground.
    pub fn frame<'m>(&self, frame: &'m PosedFrame<'m>, camera: Camera) -> Result<Frame<'m>, SessionError> {
        let lit = self.lights(frame, &camera);
        self.lit_frame(frame, camera, &lit)
    }

    /// The lights of a frame that `camera` sees.
    pub fn lights(&self, frame: &PosedFrame, camera: &Camera) -> ResolvedLighting {
        let light_camera = self.framing.light_camera.as_ref().unwrap_or(camera);
        self.lighting.resolve(&frame.posed, light_camera)
    }

    /// The frame as `camera` sees it in any light, without ground.
    pub fn lit_frame<'m>(
        &self,
        frame: &'m PosedFrame<'m>,
        camera: Camera,
        lit: &ResolvedLighting,
    ) -> Result<Frame<'m>, SessionError> {
        let Some(accel) = &frame.accel else {
            return Err(SessionError::Option("the scene has no acceleration structure".into()));
        };
        let plain = Frame::new(&frame.posed, accel, camera, lit);
        // All glowing surfaces light others where indirect light is traced.
        let emitters = match plain.emitters.clone() {
            _ if self.plan.options.overrides.k_e.is_some() => None,
            None if self.plan.options.indirect.unwrap_or(0) > 0 => Emitters::new(&frame.posed).map(Arc::new),
            emitters => emitters,
        };
        Ok(Frame {
            overrides: self.plan.options.overrides,
            bounces: self.plan.options.bounces,
            indirect: self.plan.options.indirect.unwrap_or(0),
            caustics: self.plan.options.caustics.unwrap_or(false),
            cull_back_faces: self.plan.options.cull != BackFaceCulling::Off,
            shadows: self.plan.options.shadows,
            unlit_scale: self.unlit_scale,
            ambient_occlusion: self.framing.occlusion,
            background: self
                .background_blur
                .and_then(|blur| lit.rig.environment.as_ref().map(|environment| environment.blurred(blur))),
            emitters,
            rounds: self.round_sizes(accel, &camera, self.plan.options.size_for(frame.posed.scene).1),
            ..plain
        })
    }

    /// The sizes of points and lines that `camera` sees in a picture of `height` pixels.
    pub fn round_sizes(&self, accel: &Accel, camera: &Camera, height: u32) -> RoundSizes {
        let Options { point_size, line_width, .. } = self.plan.options;
        round_sizes(point_size, line_width, accel, camera, height)
    }

    /// The frame with the scene or the camera rotated by a turntable.
    pub fn rotated_frame<'m>(
        &self,
        angle: f64,
        frame: &'m PosedFrame<'m>,
        camera: Camera,
    ) -> Result<Frame<'m>, SessionError> {
        let Some(TurntableRotation { axis, rotates_camera }) = self.plan.options.rotation else {
            return self.frame(frame, camera);
        };
        let rotation: DAffine3 = AxisRotation { axis, pivot: self.framing.pivot, angle }.to_affine();
        if rotates_camera {
            self.frame(frame, camera.transformed(&rotation))
        } else {
            Ok(self.frame(frame, camera)?.with_scene_motion(&rotation))
        }
    }
}

/// Returns warnings about triangles, points and lines that are not rendered. Triangles without area cause none: they cover
/// no pixel, and nearly every exporter writes some.
pub fn ignored_primitives(report: &BuildReport) -> impl Iterator<Item = Notice> {
    let (triangles, rounds) = (report.non_finite, report.non_finite_rounds);
    let triangles = (triangles > 0).then_some(Notice::NonFiniteTriangles(triangles));
    triangles.into_iter().chain((rounds > 0).then_some(Notice::NonFiniteRounds(rounds)))
}
