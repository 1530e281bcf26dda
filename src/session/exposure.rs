//! Exposure: given, or metered once per scene.

use std::time::Instant;

use crate::clip_bounds::log_clip_bounds;
use crate::error::SessionError;
use crate::image_size::natural_size;
use crate::light_advice::LightAdvice;
use crate::notice::{LackOfLight, Notice};
use crate::options::Exposure;
use crate::posed_frame::{PosedFrame, SceneSetup};
use crate::surroundings::is_enclosed;
use blinn_core::geometry::Rgb;
use blinn_render::integrator::{Phong, Stage};
use blinn_render::{MID_GREY, Metering, meter};
use blinn_scene::{Camera, ChannelTarget, MaterialProperty, ResolvedLighting, View, active_animations};

/// The exposure of all images of a scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct ResolvedExposure {
    /// In stops.
    pub ev: f64,
    /// Replaces the scale of lights if the file's light intensities have an unusual unit.
    pub light_scale: Option<f32>,
    /// True if it depends on the light of the scene.
    pub is_metered: bool,
}

impl ResolvedExposure {
    fn at(ev: f64) -> ResolvedExposure {
        ResolvedExposure { ev, ..ResolvedExposure::default() }
    }

    /// Returns the scale of the colours of unlit materials, which no exposure affects: they are display-referred. Metered
    /// and given exposures are alike, since the tasks of a job get a metered one as an option.
    pub fn unlit_scale(&self) -> f32 {
        (libm::exp2(-self.ev) as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
    }
}

/// A metered exposure of 0.
const METERED: ResolvedExposure = ResolvedExposure { ev: 0.0, light_scale: None, is_metered: true };

/// Resolves the exposure: the given one, 0 for lights that are not the file's, else metered. Metering uses the file's first
/// camera and the start of the clip, or where light or that camera is animated the brightest of some times, whichever frame
/// is rendered.
pub(crate) fn resolve_exposure(
    setup: &SceneSetup,
    start: &mut PosedFrame,
    lit: &ResolvedLighting,
) -> Result<ResolvedExposure, SessionError> {
    let SceneSetup { plan, log, .. } = setup;
    let options = &plan.options;
    let is_metered = match options.exposure {
        Some(Exposure::Stops(ev)) => return Ok(ResolvedExposure::at(ev)),
        Some(Exposure::Auto) => true,
        None => lit.uses_file_lights && options.stage != Stage::Color,
    };
    if !is_metered {
        return Ok(ResolvedExposure::at(0.0));
    }
    let camera = metering_camera(setup, start)?;
    setup.build(start)?;
    let times = metering_times(setup, start)?;
    let since = Instant::now();
    // The unit of the lights shows in their light alone.
    let lights = if lit.assumes_blender_world && options.stage != Stage::Color {
        meter_clip(setup, start, &times, &camera, MeteredLight::LightsOnly)?
    } else {
        None
    };
    let metered = match lights {
        Some(lights) if options.exposure.is_none() || !is_usual_unit(&lights) => Some(lights),
        _ => meter_clip(setup, start, &times, &camera, MeteredLight::All)?,
    };
    log.stage_since("meter", since, "");
    if let Some(lights) = lights.filter(|lights| !is_usual_unit(lights)) {
        // The unit of the lights is unknown. Environment, emission and unlit materials have none, so only the lights
        // are scaled.
        let light_scale = options.lighting.scale * libm::exp2(lights.ev) as f32;
        let light_scale = light_scale.clamp(f32::MIN_POSITIVE, f32::MAX);
        log.note(Notice::Exposure { ev: 0.0, light_scale: Some(light_scale) });
        log.hint(Notice::LightScale(light_scale));
        return Ok(ResolvedExposure { light_scale: Some(light_scale), ..METERED });
    }
    let Some(metered) = metered else {
        // Unlit materials are shown as they are.
        if meter_clip(setup, start, &times, &camera, MeteredLight::Unlit)?.is_some() {
            return Ok(METERED);
        }
        let lost_lights = start.posed.scene.lost_light_names();
        let eye = (camera.camera.view_point - start.posed.centre).as_vec3();
        let advice = LightAdvice {
            is_metered: true,
            is_indirect: options.indirect.is_some_and(|bounces| bounces > 0),
            is_enclosed: start.accel.as_ref().is_some_and(|accel| is_enclosed(&start.posed, accel, eye)),
            ..LightAdvice::of_lighting(lit)
        };
        log.warn(Notice::NothingLit(LackOfLight { sources: lit.description.clone(), lost_lights, advice }))?;
        return Ok(METERED);
    };
    // Blender's files near mid-grey are exposed as their author saw them.
    let is_blender = start.posed.scene.source.is_blender();
    let keeps_zero = options.exposure.is_none() && is_blender && is_usual_unit(&metered);
    let ev = if keeps_zero { 0.0 } else { (metered.ev * 1e4).round() / 1e4 };
    log.note(Notice::Exposure { ev, light_scale: None });
    Ok(ResolvedExposure { ev, ..METERED })
}

/// True for light in the usual unit: within 4 stops of mid-grey, or mid-grey somewhere.
///
/// A room that is dark except under a lamp is dark on purpose. In another unit, at least 54 times too weak, the light
/// under the lamp would be dark, too.
fn is_usual_unit(light: &Metering) -> bool {
    let is_near_mid_grey = light.below_mid_grey.abs() <= 4.0;
    is_near_mid_grey || light.below_mid_grey > 0.0 && light.percentile_99 >= MID_GREY
}

/// The light that is metered.
#[derive(Clone, Copy, PartialEq, Eq)]
enum MeteredLight {
    /// All that an exposure affects.
    All,
    /// That, and the colours of unlit materials.
    Unlit,
    /// Light from light sources, without ambient, environment and emission.
    LightsOnly,
}

struct MeteringCamera {
    camera: Camera,
    /// Width over height.
    aspect: f64,
}

/// The camera for metering. Its aspect ratio is the camera's own, not the image's, so that thumbnails have the
/// exposure of their originals.
fn metering_camera(setup: &SceneSetup, start: &PosedFrame) -> Result<MeteringCamera, SessionError> {
    let scene = start.posed.scene;
    let (width, height) = natural_size(scene, scene.default_camera());
    let view = if scene.cameras.is_empty() {
        setup.plan.options.view.without_orbit()
    } else {
        View { clip: setup.plan.options.view.clip, ..View::default() }
    };
    let (camera, _) =
        log_clip_bounds(setup.log, &start.posed, || view.resolve(&start.posed, width, height))??;
    Ok(MeteringCamera { camera, aspect: f64::from(width) / f64::from(height) })
}

/// Times after the start of a clip with animated light that are metered too.
const LATER_TIMES: u32 = 4;

/// Returns the times after the start that are metered: some in equal steps up to the end, if light is animated, or if
/// lights or the metering camera move.
fn metering_times(setup: &SceneSetup, start: &PosedFrame) -> Result<Vec<f64>, SessionError> {
    let scene = start.posed.scene;
    let choice = setup.plan.options.animation(scene)?;
    let has_light = scene.nodes_with_lights();
    let camera = scene.default_camera().map(|camera| scene.cameras[camera].node);
    let has_camera = scene.nodes_at_or_above(camera);
    let is_light = |target: &ChannelTarget| match *target {
        ChannelTarget::Light(..)
        | ChannelTarget::AreaLight(..)
        | ChannelTarget::Environment(..)
        | ChannelTarget::Material(_, MaterialProperty::Emission | MaterialProperty::EmissionStrength) => true,
        ChannelTarget::Translation(node) | ChannelTarget::Rotation(node) | ChannelTarget::Scale(node) => {
            has_light[node as usize] || has_camera[node as usize]
        }
        ChannelTarget::Visibility(node) => has_light[node as usize],
        _ => false,
    };
    let mut channels = active_animations(scene, &choice)?.into_iter().flat_map(|a| &a.channels);
    if !channels.any(|channel| is_light(&channel.target)) {
        return Ok(Vec::new());
    }
    let step = setup.clip_duration / f64::from(LATER_TIMES);
    Ok((1..=LATER_TIMES).map(|i| step * f64::from(i)).collect())
}

/// Meters the start of the clip and the later `times`, and returns the brightest result.
fn meter_clip(
    setup: &SceneSetup,
    start: &PosedFrame,
    times: &[f64],
    camera: &MeteringCamera,
    light: MeteredLight,
) -> Result<Option<Metering>, SessionError> {
    let mut brightest = meter_frame(setup, start, camera, light)?;
    let mut accel = None;
    for &time in times {
        let frame = setup.pose_at(time, start, accel.take())?;
        // A camera of the file may move, even to where it is of no use; a framed view stays.
        let moves = !frame.posed.cameras.is_empty();
        let moved = moves.then(|| metering_camera(setup, &frame).ok()).flatten();
        let metered = meter_frame(setup, &frame, moved.as_ref().unwrap_or(camera), light)?;
        accel = frame.accel;
        brightest = match (brightest, metered) {
            (Some(a), Some(b)) => Some(if b.ev < a.ev { b } else { a }),
            (a, b) => a.or(b),
        };
    }
    Ok(brightest)
}

fn meter_frame(
    setup: &SceneSetup,
    start: &PosedFrame,
    camera: &MeteringCamera,
    light: MeteredLight,
) -> Result<Option<Metering>, SessionError> {
    let mut frame = setup.frame(start, camera.camera)?;
    frame.background = None;
    frame.unlit_scale = if light == MeteredLight::Unlit { 1.0 } else { 0.0 };
    if light == MeteredLight::LightsOnly {
        frame.ambient = Rgb::ZERO;
        frame.sky = None;
        frame.environment = None;
        frame.emitters = None;
        // The override also turns off reflections, which show the environment, and makes glass thin.
        frame.overrides.k_e = Some(Rgb::ZERO);
    }
    Ok(meter(&frame, &Phong { stage: setup.plan.options.stage }, camera.aspect, &setup.cancel)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_exposure_affects_unlit_materials() {
        for ev in [0.0, 1.0, -17.0, 12.5] {
            for exposure in [ResolvedExposure::at(ev), ResolvedExposure { ev, ..METERED }] {
                let shown = f64::from(exposure.unlit_scale()) * libm::exp2(ev);
                assert!((shown - 1.0).abs() < 1e-6, "{ev}");
            }
        }
        assert!([1e9, -1e9].iter().all(|&ev| {
            let scale = ResolvedExposure::at(ev).unlit_scale();
            scale > 0.0 && scale.is_finite()
        }));
    }
}
