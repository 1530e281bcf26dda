//! Extensions of materials that `gltf::json` does not type.

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::json_tree::Object;
use crate::error::Warnings;
use crate::files::escape::printable;

/// Returns the extension `name` among those of a material that are not typed; its default if it is missing.
pub(super) fn read<T: DeserializeOwned + Default>(others: Option<&Object>, name: &str) -> T {
    let body = others.and_then(|others| others.get(name)).cloned();
    // Invalid members have been removed.
    body.and_then(|body| serde_json::from_value(body).ok()).unwrap_or_default()
}

/// Removes members of the wrong type from the extension `name` of a material, each with a warning.
pub(super) fn repair<T: DeserializeOwned>(
    material: &mut Object,
    name: &str,
    location: &str,
    warnings: &mut Warnings,
) {
    let body = material.get_mut("extensions").and_then(|extensions| extensions.get_mut(name));
    let Some(Value::Object(body)) = body else { return };
    body.retain(|key, value| {
        let alone = Value::Object(Object::from_iter([(key.clone(), value.clone())]));
        let valid = T::deserialize(alone).is_ok();
        if !valid {
            let value = printable(&value.to_string()).replace('"', "'");
            let location = format_args!("{location}.extensions.{name}.{}", printable(key));
            warnings.add(location, format_args!("ignored invalid value {value}"));
        }
        valid
    });
}
