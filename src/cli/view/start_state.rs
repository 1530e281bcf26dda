//! The first state of a view, from the command line and the scene.

use anyhow::Result;
use glam::DVec3;

use super::start_flags::StartFlags;
use super::state::{CameraState, ExposureState, OrbitState, ProjectionState, ViewState};
use crate::plan::RenderPlan;
use blinn_render::display::ViewTransform;
use blinn_scene::{
    AnimationChoice, Camera, DEFAULT_YFOV, LightSet, PosedScene, Projection, Scene, View, active_animations,
};
use blinn_session::{Exposure, Framing};

/// The state that shows what `blinn render` would with the same flags.
///
/// # Errors
/// The camera does not suit the scene.
pub fn start_state(plan: &RenderPlan, flags: &StartFlags, posed: &PosedScene) -> Result<ViewState> {
    let options = &plan.session.options;
    let scene = posed.scene;
    let framing = Framing::new(&plan.session, posed, options.size_for(scene))?;
    let lit = options.lighting.resolve(posed, &framing.camera);
    Ok(ViewState {
        camera: start_camera(plan, posed, &framing.camera),
        hidden: Vec::new(),
        variant: options.load.variant.clone(),
        animation: start_animation(&options.animation(scene)?, scene)?,
        time: plan.frames.known().and_then(|frames| Some(frames.first()?.time)).unwrap_or(0.0),
        lights: light_names(&lit.sets),
        exposure: match options.exposure {
            Some(Exposure::Stops(ev)) => ExposureState::Stops(ev),
            _ => ExposureState::default(),
        },
        view_transform: match options.view_transform {
            None => "auto",
            Some(ViewTransform::Standard) => "standard",
            Some(ViewTransform::Agx) => "agx",
            Some(ViewTransform::Filmic) => "filmic",
            Some(ViewTransform::PbrNeutral) => "pbr-neutral",
            Some(ViewTransform::Raw) => "raw",
        }
        .into(),
        hdri: flags.hdri().map(String::from),
        hdri_rotate: options.lighting.environment_rotation.to_degrees(),
        background: flags.all.value("background").and_then(|value| value.to_str()).unwrap_or_default().into(),
        ground: options.ground.is_some(),
        ao: options.ao.map_or(0, |ao| ao.samples),
        samples: options.samples,
    })
}

/// The animation that plays; the first of several.
fn start_animation(choice: &AnimationChoice, scene: &Scene) -> Result<Option<u32>> {
    Ok(match choice {
        AnimationChoice::Rest => None,
        AnimationChoice::One(index) => u32::try_from(*index).ok(),
        _ => (!active_animations(scene, choice)?.is_empty()).then_some(0),
    })
}

fn light_names(sets: &[LightSet]) -> String {
    let name = |set: &LightSet| match set {
        LightSet::File => "file",
        LightSet::Headlight => "headlight",
        LightSet::ThreePoint => "three-point",
    };
    if sets.is_empty() { "none".into() } else { sets.iter().map(name).collect::<Vec<_>>().join(",") }
}

/// The camera of the file if the command line changes nothing about it, else one on a sphere around the point on its
/// axis that is closest to the scene's centre.
fn start_camera(plan: &RenderPlan, posed: &PosedScene, camera: &Camera) -> CameraState {
    let scene = posed.scene;
    let view = &plan.session.options.view;
    let without_lens = View { camera: None, fit: Default::default(), clip: None, ..view.clone() };
    let is_unchanged = without_lens == View::default();
    if is_unchanged && view.uses_file_camera(scene) {
        let index =
            view.camera.as_ref().map_or_else(|| scene.default_camera(), |name| scene.find_camera(name));
        if let Some(index) = index.and_then(|index| u32::try_from(index).ok()) {
            return CameraState::File { index };
        }
    }
    CameraState::Orbit(orbit_of(camera, view.look_at, posed))
}

fn orbit_of(camera: &Camera, look_at: Option<DVec3>, posed: &PosedScene) -> OrbitState {
    let sphere = posed.clip_sphere();
    let target = look_at.unwrap_or_else(|| camera.axis_point(sphere.centre));
    let distance = target.distance(camera.view_point);
    let distance = if distance > 0.0 { distance } else { 1.0 };
    let w = camera.basis.w;
    let height_at_target = match camera.projection {
        Projection::Perspective => camera.view_height * distance / camera.proj_distance,
        Projection::Orthographic => camera.view_height,
    };
    let yfov = match camera.projection {
        Projection::Perspective => 2.0 * libm::atan(0.5 * camera.view_height / camera.proj_distance),
        Projection::Orthographic => DEFAULT_YFOV,
    };
    OrbitState {
        target: target.to_array(),
        azimuth: rounded(libm::atan2(w.x, w.z).to_degrees()),
        elevation: rounded(libm::asin(w.y.clamp(-1.0, 1.0)).to_degrees()),
        distance,
        yfov: rounded(yfov.to_degrees()),
        projection: match camera.projection {
            Projection::Perspective => ProjectionState::Perspective,
            Projection::Orthographic => ProjectionState::Orthographic,
        },
        height: height_at_target,
    }
}

/// Angles in degrees without the noise of their conversion.
fn rounded(degrees: f64) -> f64 {
    (degrees * 1e9).round() / 1e9
}
