//! EXT_lights_area (draft): rectangles and discs that emit on one side.

use ::gltf::json::Root;
use glam::Vec3;
use serde::Deserialize;
use serde_json::Value;

use super::{blinn_extras, node_light};
use crate::error::Warnings;
use blinn_scene::{AreaLight, AreaLightShape};

pub(super) const NAME: &str = "EXT_lights_area";

/// Values of `type`.
pub(super) const TYPES: [&str; 2] = ["rect", "disk"];

/// A light in the file.
#[derive(Debug, Deserialize)]
pub(super) struct JsonAreaLight {
    name: Option<String>,
    #[serde(rename = "type")]
    type_: String,
    #[serde(default = "default_color")]
    color: [f32; 3],
    /// Nits.
    #[serde(default = "default_intensity")]
    intensity: f32,
    /// Height of a rectangle, diameter of a disc.
    #[serde(default = "one")]
    size: f32,
    rect: Option<JsonRect>,
    extras: Option<Value>,
}

#[derive(Debug, Deserialize)]
struct JsonRect {
    /// Width divided by height.
    #[serde(default = "one")]
    aspect: f32,
}

fn default_color() -> [f32; 3] {
    [1.0; 3]
}

fn default_intensity() -> f32 {
    1000.0
}

fn one() -> f32 {
    1.0
}

/// Reads light `light` of the file for `node`; `None`, with a warning, if there is none of a known type. `node_index` is
/// the node in the file.
pub(super) fn read(
    root: &Root,
    light: u64,
    node_index: usize,
    node: u32,
    warnings: &mut Warnings,
) -> Option<AreaLight> {
    let lights = node_light::lights_of(root, NAME);
    let json = usize::try_from(light).ok().and_then(|i| lights.get(i));
    let Some(json) = json else {
        let location = format!("nodes[{node_index}].extensions.{NAME}.light");
        warnings.add(
            location,
            format_args!("ignored area light {light}, which does not exist: the file has {}", lights.len()),
        );
        return None;
    };
    let shape = |json: &JsonAreaLight| match json.type_.as_str() {
        "rect" => Some(AreaLightShape::Rect),
        "disk" => Some(AreaLightShape::Disk),
        _ => None,
    };
    let typed = JsonAreaLight::deserialize(json).ok();
    let Some((json, shape)) = typed.and_then(|json| shape(&json).map(|shape| (json, shape))) else {
        let location = format!("extensions.{NAME}.lights[{light}].type");
        warnings.add(location, "ignored area light without a known type");
        return None;
    };
    let [width, height] = match (shape, json.rect, &json.extras) {
        (AreaLightShape::Rect, Some(rect), _) => [json.size * rect.aspect, json.size],
        // The size is the diameter of a disc of the same area.
        (AreaLightShape::Disk, _, Some(extras)) => {
            let root = blinn_extras::ellipse_aspect(extras, light, warnings).unwrap_or(1.0).sqrt();
            [json.size * root, json.size / root]
        }
        _ => [json.size; 2],
    };
    if !width.is_finite() {
        let location = format!("extensions.{NAME}.lights[{light}].rect.aspect");
        warnings.add(location, "ignored area light that is too wide");
        return None;
    }
    Some(AreaLight {
        name: json.name.unwrap_or_default(),
        node,
        shape,
        size: [width, height],
        color: Vec3::from(json.color),
        intensity: json.intensity,
    })
}

/// Returns the lights of the file, for repairs.
pub(super) fn lights_mut(root: &mut Value) -> Option<&mut Value> {
    root.get_mut("extensions")?.get_mut(NAME)
}
