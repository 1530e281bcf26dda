//! Finds the object at a pixel.

use std::path::Path;

use anyhow::{Context, Result};

use super::frame::planned_frame;
use super::view_scene::ViewScene;
use crate::plan::RenderPlan;
use crate::run::progress::{SceneLog, quiet_reporter};
use blinn_accel::RayBatch;
use blinn_core::cancellation::CancelToken;
use blinn_render::integrator::MaterialHitFilter;
use blinn_session::{BackFaceCulling, SceneRenderer};

/// An object by its index from 0, and the point that is visible.
pub type Picked = (u32, [f64; 3]);

/// Finds the object at a point of the picture that `plan` describes, in pixels from its top left corner.
///
/// # Errors
/// The plan does not suit the scene.
pub fn pick(
    view_scene: &mut ViewScene,
    plan: &RenderPlan,
    path: &Path,
    x: f64,
    y: f64,
) -> Result<Option<Picked>> {
    let planned = planned_frame(plan)?;
    let reporter = quiet_reporter();
    let log = SceneLog::new(&reporter, path, false);
    view_scene.with_poses(|scene, poses| {
        let cancel = CancelToken::default();
        let renderer = SceneRenderer::from_start(&plan.session, scene, &log, &mut poses.start, &cancel)?;
        let frame = poses.at(&renderer.setup, planned.time)?;
        let camera = renderer.camera(&planned, &frame.posed)?;
        let (width, height) = renderer.full_size();
        let (film_x, film_y) = (x / f64::from(width), 1.0 - y / f64::from(height));
        let ray = camera.eye_ray(film_x, film_y, frame.posed.centre);
        let cull_back_faces = plan.session.options.cull != BackFaceCulling::Off;
        let mut rays = RayBatch { cull_back_faces, ..Default::default() };
        // As eye rays do.
        rays.t_min = (camera.clip.near / camera.depth_per_t()) as f32;
        rays.t_max = (camera.clip.far / camera.depth_per_t()) as f32;
        rays.push(ray.o, ray.d);
        let mut hits = Vec::new();
        let accel = frame.accel.as_ref().context("the scene has no acceleration structure")?;
        rays.rounds = renderer.setup.round_sizes(accel, &camera, height);
        accel.intersect(&rays, &MaterialHitFilter(&frame.posed), &mut hits);
        let Some(hit) = hits.first().filter(|hit| !hit.is_miss()) else { return Ok(None) };
        let point = (ray.o.as_dvec3() + ray.d.as_dvec3() * f64::from(hit.t)) + frame.posed.centre;
        let object = scene.instances[hit.id.instance as usize].object.checked_sub(1);
        Ok(object.map(|object| (object, point.to_array())))
    })
}
