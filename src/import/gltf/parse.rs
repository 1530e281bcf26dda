//! Parses the JSON of a glTF. Mistakes that exporters are known to make are repaired with a warning before
//! the JSON is typed.

use std::borrow::Cow;
use std::collections::HashMap;

use ::gltf::json::Root;
use serde_json::{Map, Value, json};

use super::json_tree::{objects, primitives};
use super::{extensions, float_integers, nonfinite, null_members, references, validate, version};
use crate::import::error::{LoadError, Warnings};

/// The typed JSON of a glTF.
#[derive(Debug)]
pub(super) struct ParsedGltf {
    /// The objects. Every index that [`references`] checks is in range, with one exception: `target.node` of
    /// an animation channel is `u32::MAX` if the channel has no node.
    pub root: Root,
    /// JSON pointers of KHR_animation_pointer by animation and channel, except those that became core
    /// channels.
    pub pointers: HashMap<(usize, usize), String>,
    /// The extensions in the file, whether listed in `extensionsUsed` or not.
    pub extensions: extensions::ExtensionUses,
}

/// Parses, repairs and types the JSON.
pub(super) fn parse(text: &[u8], warnings: &mut Warnings) -> Result<ParsedGltf, LoadError> {
    if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") || text.iter().take(4).any(|&b| b == 0)
    {
        return Err(LoadError::parse("JSON", "the text is UTF-16; save it as UTF-8"));
    }
    let text = String::from_utf8_lossy(text);
    if matches!(text, Cow::Owned(_)) {
        warnings.add("JSON", "replaced bytes that are not UTF-8");
    }
    let mut value = parse_value(&text, warnings).map_err(|e| {
        let location = format!("JSON, line {} column {}", e.line(), e.column());
        let message = e.to_string();
        LoadError::parse(location, message.split(" at line ").next().unwrap_or(&message))
    })?;
    null_members::remove_null_members(&mut value);
    let Some(root) = value.as_object_mut() else {
        return Err(LoadError::parse("JSON", "the JSON is not an object"));
    };
    version::check(root, warnings)?;
    float_integers::convert(&mut value, warnings);
    null_members::repair_names(&mut value, warnings);
    references::check_indices(&value)?;
    let pointers = extract_pointers(&mut value);
    let extensions = extensions::find_uses(&value, &pointers);
    insert_missing_properties(&mut value, warnings);
    validate::validate(&mut value, warnings);
    let root = serde_path_to_error::deserialize(value).map_err(|e| {
        let path = e.path().to_string();
        LoadError::parse(path, e.into_inner())
    })?;
    Ok(ParsedGltf { root, pointers, extensions })
}

/// Parses JSON. Text that is not JSON is parsed once more with NaN and Infinity replaced by null.
fn parse_value(text: &str, warnings: &mut Warnings) -> serde_json::Result<Value> {
    serde_json::from_str(text).or_else(|error| {
        let Some(replaced) = nonfinite::replace_by_null(text) else { return Err(error) };
        let mut value = serde_json::from_str(&replaced.text)?;
        null_members::remove_arrays_with_null(&mut value);
        warnings.add(
            format_args!("JSON, line {} column {}", replaced.first.line, replaced.first.column),
            format_args!(
                "ignored {} invalid numbers (NaN or Infinity) and the arrays with them",
                replaced.count
            ),
        );
        Ok(value)
    })
}

/// Removes the targets of KHR_animation_pointer and returns their pointers. Pointers to a node's transform or
/// weights become core channels instead.
fn extract_pointers(value: &mut Value) -> HashMap<(usize, usize), String> {
    let nodes = value.get("nodes").and_then(Value::as_array).map_or(0, Vec::len);
    let mut pointers = HashMap::new();
    for (animation, object) in objects(value, "animations") {
        let Some(channels) = object.get_mut("channels").and_then(Value::as_array_mut) else { continue };
        for (channel, object) in channels.iter_mut().enumerate() {
            let Some(target) = object.get_mut("target").and_then(Value::as_object_mut) else { continue };
            let pointer = target.get("extensions").and_then(|e| e.get("KHR_animation_pointer"));
            let Some(pointer) = pointer.and_then(|e| e.get("pointer")).and_then(Value::as_str) else {
                continue;
            };
            let pointer = pointer.to_string();
            let parts: Vec<&str> = pointer.split('/').collect();
            if let ["", "nodes", node, path @ ("translation" | "rotation" | "scale" | "weights")] = parts[..]
                && let Some(node) = node.parse::<usize>().ok().filter(|&n| n < nodes)
            {
                target.insert("path".into(), json!(path));
                target.insert("node".into(), json!(node));
            } else {
                target.insert("path".into(), json!("pointer"));
                target.remove("node");
                pointers.insert((animation, channel), pointer);
            }
        }
    }
    pointers
}

/// Inserts a missing property.
fn insert_missing(object: &mut Map<String, Value>, key: &str, default: Value) {
    if !object.contains_key(key) {
        object.insert(key.into(), default);
    }
}

/// Inserts a missing required property with a warning.
fn insert_required(
    location: &dyn Fn() -> String,
    object: &mut Map<String, Value>,
    key: &str,
    default: Value,
    warnings: &mut Warnings,
) {
    if !object.contains_key(key) {
        warnings.add(location(), format_args!("required property '{key}' is missing; used {default}"));
        object.insert(key.into(), default);
    }
}

/// Inserts required properties whose default is obvious.
fn insert_missing_properties(value: &mut Value, warnings: &mut Warnings) {
    for (_, scene) in objects(value, "scenes") {
        // Optional in the specification.
        insert_missing(scene, "nodes", json!([]));
    }
    for (array, keys) in
        [("meshes", &["primitives"][..]), ("skins", &["joints"]), ("animations", &["channels", "samplers"])]
    {
        for (i, object) in objects(value, array) {
            for key in keys {
                insert_required(&|| format!("{array}[{i}]"), object, key, json!([]), warnings);
            }
        }
    }
    for (i, mesh) in objects(value, "meshes") {
        for (j, primitive) in primitives(mesh) {
            let location = || format!("meshes[{i}].primitives[{j}]");
            insert_required(&location, primitive, "attributes", json!({}), warnings);
        }
    }
    for (_, animation) in objects(value, "animations") {
        let channels = animation.get_mut("channels").and_then(Value::as_array_mut).into_iter().flatten();
        for target in channels.filter_map(|channel| channel.get_mut("target")?.as_object_mut()) {
            // The animation reader ignores such channels.
            insert_missing(target, "node", json!(u32::MAX));
            insert_missing(target, "path", json!("none"));
        }
    }
    for (i, camera) in objects(value, "cameras") {
        if let Some(Value::Object(perspective)) = camera.get_mut("perspective") {
            let location = || format!("cameras[{i}].perspective");
            insert_required(&location, perspective, "znear", json!(0), warnings);
        }
    }
}
