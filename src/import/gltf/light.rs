//! Cameras and lights (KHR_lights_punctual).

use ::gltf::json::camera::{Camera, Type};
use ::gltf::json::extensions::scene::khr_lights_punctual::{Light as JsonLight, Type as LightType};
use ::gltf::json::validation::Checked;
use glam::Vec3;
use serde_json::Value;

use super::blinn_extras::{self, Lens};
use crate::error::Warnings;
use blinn_scene::{FileCamera, FileProjection, Light, LightKind, LightUnits};

/// Reads the camera of a node; `None`, with a warning, if its projection is invalid.
pub(super) fn camera(json: &Camera, index: usize, node: u32, warnings: &mut Warnings) -> Option<FileCamera> {
    let positive = |x: f32| (x.is_finite() && x > 0.0).then_some(f64::from(x));
    let read = || match (&json.type_, &json.perspective, &json.orthographic) {
        (Checked::Valid(Type::Perspective), Some(p), _) => {
            let yfov = positive(p.yfov).filter(|&y| y < std::f64::consts::PI)?;
            let aspect = p.aspect_ratio.and_then(positive);
            let far = p.zfar.and_then(positive).unwrap_or(f64::INFINITY);
            Some((FileProjection::Perspective { yfov, aspect }, p.znear, far))
        }
        (Checked::Valid(Type::Orthographic), _, Some(o)) => {
            // Some exporters write negative magnitudes, which render the same.
            let xmag = positive(o.xmag.abs())?;
            let ymag = positive(o.ymag.abs())?;
            Some((FileProjection::Orthographic { xmag, ymag }, o.znear, f64::from(o.zfar)))
        }
        _ => None,
    };
    let Some((projection, znear, zfar)) = read() else {
        warnings.add(format_args!("cameras[{index}]"), "ignored camera without a valid projection");
        return None;
    };
    let znear = f64::from(znear).max(0.0);
    let zfar = if zfar > znear { zfar } else { f64::INFINITY };
    let Lens { shift, lens } = blinn_extras::lens(json.extras.as_ref().map(|raw| raw.get()), index, warnings);
    let name = json.name.clone().unwrap_or_default();
    Some(FileCamera { name, node, projection, znear, zfar, shift, lens })
}

/// Names of a light's radius in its `extras`: Blender's exporter writes the custom properties of a light there.
const RADII: [&str; 2] = ["shadow_soft_size", "radius"];
/// Name of the angle that a sun subtends, in radians.
const ANGLE: &str = "angle";

/// Returns the radius of a light, from its `extras`; 0 if they have none.
fn radius(json: &JsonLight, kind: LightKind, index: usize, warnings: &mut Warnings) -> f32 {
    let extras = json.extras.as_ref().and_then(|raw| serde_json::from_str::<Value>(raw.get()).ok());
    let Some(extras) = extras else { return 0.0 };
    let number = |name: &'static str| Some((name, extras.get(name)?.as_f64()?));
    let found = match kind {
        LightKind::Directional => number(ANGLE),
        LightKind::Point | LightKind::Spot { .. } | LightKind::Photometric { .. } => {
            RADII.into_iter().find_map(number)
        }
    };
    let Some((name, value)) = found else { return 0.0 };
    let radius = if name == ANGLE { (0.5 * value).tan() } else { value } as f32;
    let is_valid = value >= 0.0 && radius.is_finite() && (name != ANGLE || value < std::f64::consts::PI);
    if is_valid {
        return radius;
    }
    let location = format!("extensions.KHR_lights_punctual.lights[{index}].extras.{name}");
    warnings.add(location, format_args!("ignored invalid value {value}"));
    0.0
}

/// Reads the light of a node in a file with lights in `units`; `None`, with a warning, if its type is unknown.
pub(super) fn light(
    json: &JsonLight,
    index: usize,
    node: u32,
    units: LightUnits,
    warnings: &mut Warnings,
) -> Option<Light> {
    let kind = match json.type_ {
        Checked::Valid(LightType::Point) => LightKind::Point,
        Checked::Valid(LightType::Directional) => LightKind::Directional,
        Checked::Valid(LightType::Spot) => {
            let spot = json.spot.as_ref();
            LightKind::Spot {
                inner: spot.map_or(0.0, |s| s.inner_cone_angle),
                outer: spot.map_or(std::f32::consts::FRAC_PI_4, |s| s.outer_cone_angle),
            }
        }
        Checked::Invalid => {
            let location = format!("extensions.KHR_lights_punctual.lights[{index}].type");
            warnings.add(location, "ignored light of unknown type");
            return None;
        }
    };
    let light = Light {
        name: json.name.clone().unwrap_or_default(),
        node,
        kind,
        color: Vec3::from(json.color),
        intensity: json.intensity,
        range: json.range.filter(|&r| r > 0.0).unwrap_or(f32::INFINITY),
        radius: radius(json, kind, index, warnings),
    };
    let extras = json.extras.as_ref().map(|raw| raw.get());
    Some(blinn_extras::extended_light(light, extras, index, units, warnings))
}
