//! Removes invalid members that have no influence on the image, so that they cannot make a file unreadable.

use serde_json::Value;

use super::json_tree::{Object, for_each_object, objects, path_text};
use super::{area_light, photometric_light};
use crate::error::Warnings;
use crate::files::escape::printable;

type IsValid = fn(&Value) -> bool;

fn is_index(value: &Value) -> bool {
    value.as_u64().is_some_and(|number| number <= u64::from(u32::MAX))
}

/// Members by the array of their objects, and their type.
const MEMBERS: [(&str, &str, IsValid); 5] = [
    ("bufferViews", "target", is_index),
    ("samplers", "magFilter", is_index),
    ("samplers", "minFilter", is_index),
    ("images", "mimeType", Value::is_string),
    ("skins", "skeleton", is_index),
];

/// Removes members of the wrong type and `extensions` that are not objects, each with a warning.
pub(super) fn remove_invalid(root: &mut Value, warnings: &mut Warnings) {
    for (array, key, is_valid) in MEMBERS {
        for (i, object) in objects(root, array) {
            remove(object, key, is_valid, &format!("{array}[{i}]"), warnings);
        }
    }
    if let Some(asset) = root.get_mut("asset").and_then(Value::as_object_mut) {
        remove(asset, "minVersion", Value::is_string, "asset", warnings);
    }
    for_each_object(root, &mut |object, path| {
        match object.get("extensions") {
            None | Some(Value::Object(_)) => {}
            // Lua and PHP write empty objects as arrays.
            Some(Value::Array(items)) if items.is_empty() => {
                object.remove("extensions");
            }
            Some(_) => remove(object, "extensions", Value::is_object, &path_text(path), warnings),
        }
    });
    let Some(root) = root.as_object_mut() else { return };
    for key in ["extensionsUsed", "extensionsRequired"] {
        if let Some(name) = root.get_mut(key).filter(|value| value.is_string()) {
            *name = Value::Array(vec![name.take()]);
        }
        remove(root, key, Value::is_array, "", warnings);
        if let Some(names) = root.get_mut(key).and_then(Value::as_array_mut) {
            names.retain(Value::is_string);
        }
    }
    if let Some(extensions) = root.get_mut("extensions").and_then(Value::as_object_mut) {
        for name in ["KHR_lights_punctual", area_light::NAME, photometric_light::NAME] {
            let has_lights = |body: &Value| body.get("lights").is_some_and(Value::is_array);
            remove(extensions, name, has_lights, "extensions", warnings);
        }
    }
}

fn remove(object: &mut Object, key: &str, is_valid: IsValid, location: &str, warnings: &mut Warnings) {
    if let Some(value) = object.get(key).filter(|value| !is_valid(value)) {
        let value = printable(&value.to_string()).replace('"', "'");
        let separator = if location.is_empty() { "" } else { "." };
        warnings
            .add(format_args!("{location}{separator}{key}"), format_args!("ignored invalid value {value}"));
        object.remove(key);
    }
}
