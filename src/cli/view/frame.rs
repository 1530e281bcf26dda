//! Renders frames: coarse ones while the view changes, and the picture with the bytes of `blinn render`.

use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use serde_json::{Value, json};

use super::view_scene::ViewScene;
use crate::plan::{OutputKind, RenderPlan};
use crate::run::image_sink::image_fingerprint;
use crate::run::progress::{SceneLog, quiet_reporter};
use blinn_core::cancellation::CancelToken;
use blinn_output::{BitDepth, ImageFormat, Picture};
use blinn_render::display::Background;
use blinn_scene::{Camera, Projection};
use blinn_session::{
    EmptyImages, ImageKind, OcclusionSampling, PlannedFrame, SceneRenderer, SessionLog, check_memory,
};

/// JPEG quality of all frames but the last.
const DRAFT_QUALITY: u8 = 82;
/// Maximum number of reflections along a path in coarse frames.
const DRAFT_BOUNCES: u8 = 1;
/// Maximum number of ambient occlusion rays in coarse frames.
const DRAFT_OCCLUSION: u32 = 2;

/// Size and samples of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// One sample for each pixel of a smaller picture.
    Coarse { width: u32, height: u32 },
    /// One sample for each pixel.
    Draft,
    /// The picture itself.
    Final,
}

/// A frame for the page.
pub struct Frame {
    pub bytes: Vec<u8>,
    pub mime: &'static str,
    pub size: (u32, u32),
    pub samples: u32,
    pub is_final: bool,
    /// Time for the pixels and their encoding, without that for the scene.
    pub time: Duration,
    pub camera: Value,
    /// In stops.
    pub exposure: f64,
    pub warnings: Vec<String>,
}

impl Frame {
    /// Seconds for a sample of a pixel.
    pub fn cost(&self) -> f64 {
        let samples = f64::from(self.size.0) * f64::from(self.size.1) * f64::from(self.samples);
        self.time.as_secs_f64() / samples.max(1.0)
    }

    /// The message before the bytes.
    pub fn header(&self, serial: u64) -> String {
        json!({
            "type": "frame", "serial": serial, "width": self.size.0, "height": self.size.1,
            "samples": self.samples, "final": self.is_final, "mime": self.mime, "bytes": self.bytes.len(),
            "milliseconds": (self.time.as_secs_f64() * 1e4).round() / 10.0,
            "camera": self.camera, "exposure": self.exposure,
        })
        .to_string()
    }
}

/// Renders a frame of the picture that `plan` describes. `view_scene` shows its parts.
///
/// # Errors
/// The plan does not suit the scene, or it is cancelled.
pub fn render_frame(
    view_scene: &mut ViewScene,
    plan: &RenderPlan,
    path: &Path,
    quality: Quality,
    cancel: &CancelToken,
) -> Result<Frame> {
    let file_indirect = view_scene.scene()?.settings.indirect;
    let plan = &with_quality(plan, quality, file_indirect);
    let planned = planned_frame(plan)?;
    let reporter = quiet_reporter();
    let log = SceneLog::new(&reporter, path, false).collecting();
    let frame = view_scene.with_poses(|scene, poses| {
        check_memory(&plan.session, scene, 1)?;
        let renderer = SceneRenderer::from_start(&plan.session, scene, &log, &mut poses.start, cancel)?;
        let posed = poses.at(&renderer.setup, planned.time)?;
        let start = Instant::now();
        let image = renderer.render(&planned, posed, cancel)?;
        let camera = image.view.map(|view| describe_camera(&view.camera));
        let format = draft_format(&image.picture, quality);
        let bytes = match format {
            Some(format) => format.encode(&image.picture, BitDepth::Default)?,
            None => {
                let is_empty = image.empty.is_some();
                let fingerprint = image_fingerprint(plan, &planned, image.view, path, scene, is_empty);
                encode_final(plan, &Picture { fingerprint, ..image.picture })?
            }
        };
        let empty_images = EmptyImages::default();
        image.empty.map(|reason| empty_images.add(reason, planned.number));
        empty_images.summary(1).map_or(Ok(()), |notice| log.warn(notice))?;
        let is_jpeg = matches!(format, Some(ImageFormat::Jpeg(_)));
        Ok(Frame {
            bytes,
            mime: if is_jpeg { "image/jpeg" } else { "image/png" },
            size: renderer.size(),
            samples: plan.session.options.samples,
            is_final: quality == Quality::Final,
            time: start.elapsed(),
            camera: camera.unwrap_or(Value::Null),
            exposure: renderer.exposure.ev,
            warnings: Vec::new(),
        })
    })?;
    Ok(Frame { warnings: log.finish(), ..frame })
}

/// The plan of a frame of lower quality. `file_indirect` is the file's number of diffuse bounces.
fn with_quality(plan: &RenderPlan, quality: Quality, file_indirect: Option<u8>) -> RenderPlan {
    let mut plan = plan.clone();
    if quality == Quality::Final {
        return plan;
    }
    let options = &mut plan.session.options;
    options.samples = 1;
    options.adaptive = None;
    if let Quality::Coarse { width, height } = quality {
        options.size = Some((width, height));
        options.bounces = options.bounces.min(DRAFT_BOUNCES);
        options.indirect = options.indirect.or(file_indirect).map(|bounces| bounces.min(DRAFT_BOUNCES));
        options.ao =
            options.ao.map(|ao| OcclusionSampling { samples: ao.samples.min(DRAFT_OCCLUSION), ..ao });
    }
    plan
}

/// A format that is encoded and sent sooner; `None` for the picture itself.
fn draft_format(picture: &Picture, quality: Quality) -> Option<ImageFormat> {
    let is_opaque = picture.display.background != Background::Transparent;
    match quality {
        Quality::Final => None,
        _ if is_opaque => Some(ImageFormat::Jpeg(DRAFT_QUALITY)),
        _ => Some(ImageFormat::Png),
    }
}

/// Encodes a picture as `blinn render` does.
fn encode_final(plan: &RenderPlan, picture: &Picture) -> Result<Vec<u8>> {
    match plan.outputs.kind {
        OutputKind::Images(ImageKind { format, depth }) => Ok(format.encode(picture, depth)?),
        OutputKind::Animation(_) => bail!("a picture is no animation"),
    }
}

/// The camera for the page: e, u, v, w, and the view rectangle at distance d.
fn describe_camera(camera: &Camera) -> Value {
    let half = 0.5 * glam::DVec2::new(camera.view_width, camera.view_height);
    let (low, high) = (camera.view_centre - half, camera.view_centre + half);
    json!({
        "view_point": camera.view_point.to_array(),
        "u": camera.basis.u.to_array(),
        "v": camera.basis.v.to_array(),
        "w": camera.basis.w.to_array(),
        "d": camera.proj_distance,
        "rect": [low.x, high.x, low.y, high.y],
        "projection": match camera.projection {
            Projection::Perspective => "perspective",
            Projection::Orthographic => "orthographic",
        },
    })
}

/// The frame that a plan for one picture has.
pub fn planned_frame(plan: &RenderPlan) -> Result<PlannedFrame> {
    let frames = plan.frames.resolve(0.0, None)?;
    frames.first().copied().ok_or_else(|| anyhow::anyhow!("there is no frame"))
}
