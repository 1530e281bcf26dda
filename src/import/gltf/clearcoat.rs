//! KHR_materials_clearcoat, which `gltf::json` does not type.

use ::gltf::json::texture::Info;
use serde::Deserialize;
use serde_json::Value;

use super::json_tree::Object;
use crate::error::Warnings;
use crate::files::escape::printable;

pub(super) const NAME: &str = "KHR_materials_clearcoat";

/// The extension's properties that are rendered.
#[derive(Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Clearcoat {
    pub clearcoat_factor: f32,
    pub clearcoat_texture: Option<Info>,
    pub clearcoat_roughness_factor: f32,
    pub clearcoat_roughness_texture: Option<Info>,
}

/// Returns the extension among those of a material that are not typed.
pub(super) fn read(others: &Object) -> Clearcoat {
    let body = others.get(NAME).cloned().unwrap_or_default();
    // Invalid members have been removed.
    serde_json::from_value(body).unwrap_or_default()
}

/// Removes members of the wrong type, each with a warning, and warns of the coat's normal map.
pub(super) fn repair(material: &mut Object, location: &str, warnings: &mut Warnings) {
    let body = material.get_mut("extensions").and_then(|extensions| extensions.get_mut(NAME));
    let Some(Value::Object(body)) = body else { return };
    body.retain(|key, value| {
        let alone = Value::Object(Object::from_iter([(key.clone(), value.clone())]));
        let valid = Clearcoat::deserialize(alone).is_ok();
        if !valid {
            let value = printable(&value.to_string()).replace('"', "'");
            let location = format_args!("{location}.extensions.{NAME}.{}", printable(key));
            warnings.add(location, format_args!("ignored invalid value {value}"));
        }
        valid
    });
    let factor = body.get("clearcoatFactor").and_then(Value::as_f64).unwrap_or(0.0);
    if factor > 0.0 && body.contains_key("clearcoatNormalTexture") {
        let location = format_args!("{location}.extensions.{NAME}.clearcoatNormalTexture");
        warnings.add(location, "ignored the normal map of the coat: not supported");
    }
}
