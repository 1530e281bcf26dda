//! Lights: radii of points and spots, angles and strengths of suns, and the shape of elliptic area lights.

use glam::Vec3;
use serde_json::Value;

use super::Members;
use crate::error::Warnings;
use blinn_scene::{LUMENS_PER_WATT, Light, LightKind, LightUnits};

/// Largest number of a light.
const MAX: f64 = f32::MAX as f64;

/// Returns light `index` of the file with what its `extras` say. The file's lights are in `units`.
pub fn extended_light(
    light: Light,
    extras: Option<&str>,
    index: usize,
    units: LightUnits,
    warnings: &mut Warnings,
) -> Light {
    let place = format_args!("extensions.KHR_lights_punctual.lights[{index}]");
    let Some(members) = Members::of(extras, place, warnings) else { return light };
    if light.kind != LightKind::Directional {
        let radius = members.number("radius", 0.0..=MAX, warnings).map(|radius| radius as f32);
        return Light { radius: radius.unwrap_or(light.radius), ..light };
    }
    let radius = members
        .number("angle", 0.0..std::f64::consts::PI, warnings)
        .map(|angle| libm::tan(0.5 * angle) as f32);
    // W/m². Exporters of some versions write the same illuminance for all suns of Cycles.
    let strength = members.number("strength", 0.0..=MAX / LUMENS_PER_WATT, warnings);
    let factor = if units == LightUnits::Standard { LUMENS_PER_WATT } else { 1.0 };
    let color = members.numbers::<3>("color", 0.0..=MAX, warnings);
    Light {
        radius: radius.unwrap_or(light.radius),
        intensity: strength.map_or(light.intensity, |strength| (strength * factor) as f32),
        color: color.map_or(light.color, |color| Vec3::from(color.map(|v| v as f32))),
        ..light
    }
}

/// Returns width over height of an elliptic area light from its `extras`.
pub fn ellipse_aspect(extras: &Value, light: u64, warnings: &mut Warnings) -> Option<f32> {
    let place = format_args!("extensions.EXT_lights_area.lights[{light}]");
    let members = Members::in_extras(extras, place, warnings)?;
    members.number("aspect", 1e-6..=1e6, warnings).map(|aspect| aspect as f32)
}
