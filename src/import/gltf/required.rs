//! Inserts required properties that are missing, each with a warning. What depends on a property that cannot
//! be derived is ignored, or an error, when it is used.

use serde_json::{Map, Value, json};

use super::json_tree::{Object, as_objects, objects, primitives};
use super::{area_light, photometric_light};
use crate::error::Warnings;

/// An index for which no object exists.
const NO_INDEX: u32 = u32::MAX;

/// Inserts all missing required properties.
pub(super) fn insert_missing(value: &mut Value, warnings: &mut Warnings) {
    for (_, scene) in objects(value, "scenes") {
        // Optional in the specification.
        insert_optional(scene, "nodes", json!([]));
    }
    for (array, keys) in
        [("meshes", &["primitives"][..]), ("skins", &["joints"]), ("animations", &["channels", "samplers"])]
    {
        for (i, object) in objects(value, array) {
            for key in keys {
                insert(&|| format!("{array}[{i}]"), object, key, json!([]), warnings);
            }
        }
    }
    for (i, mesh) in objects(value, "meshes") {
        for (j, primitive) in primitives(mesh) {
            let location = || format!("meshes[{i}].primitives[{j}]");
            insert(&location, primitive, "attributes", json!({}), warnings);
        }
    }
    for (i, animation) in objects(value, "animations") {
        insert_in_animation(animation, &format!("animations[{i}]"), warnings);
    }
    for (i, camera) in objects(value, "cameras") {
        insert_in_camera(camera, &format!("cameras[{i}]"), warnings);
    }
    for (i, buffer) in objects(value, "buffers") {
        // The actual length counts.
        insert(&|| format!("buffers[{i}]"), buffer, "byteLength", json!(0), warnings);
    }
    insert_in_buffer_views(value, warnings);
    insert_in_accessors(value, warnings);
    for (i, node) in objects(value, "nodes") {
        remove_light_without_index(node, &format!("nodes[{i}]"), warnings);
    }
}

fn insert_optional(object: &mut Object, key: &str, default: Value) {
    if !object.contains_key(key) {
        object.insert(key.into(), default);
    }
}

fn insert(
    location: &dyn Fn() -> String,
    object: &mut Object,
    key: &str,
    default: Value,
    warnings: &mut Warnings,
) {
    if !object.contains_key(key) {
        warnings.add(location(), format_args!("required property '{key}' is missing; used {default}"));
        object.insert(key.into(), default);
    }
}

/// Inserts a value that makes readers ignore what depends on it, or fail where it is drawn.
fn insert_invalid(
    location: &dyn Fn() -> String,
    object: &mut Object,
    key: &str,
    invalid: Value,
    warnings: &mut Warnings,
) {
    if !object.contains_key(key) {
        warnings.add(location(), format_args!("required property '{key}' is missing"));
        object.insert(key.into(), invalid);
    }
}

fn insert_in_animation(animation: &mut Object, location: &str, warnings: &mut Warnings) {
    for (i, channel) in as_objects(animation.get_mut("channels")) {
        let location = || format!("{location}.channels[{i}]");
        insert_invalid(&location, channel, "sampler", json!(NO_INDEX), warnings);
        insert_invalid(&location, channel, "target", json!({}), warnings);
        if let Some(target) = channel.get_mut("target").and_then(Value::as_object_mut) {
            // The animation reader ignores such channels.
            insert_optional(target, "node", json!(NO_INDEX));
            insert_optional(target, "path", json!("none"));
        }
    }
    for (i, sampler) in as_objects(animation.get_mut("samplers")) {
        for key in ["input", "output"] {
            insert_invalid(&|| format!("{location}.samplers[{i}]"), sampler, key, json!(NO_INDEX), warnings);
        }
    }
}

fn insert_in_camera(camera: &mut Object, location: &str, warnings: &mut Warnings) {
    if let Some(Value::Object(perspective)) = camera.get_mut("perspective") {
        insert(&|| format!("{location}.perspective"), perspective, "znear", json!(0), warnings);
    }
    if let Some(Value::Object(orthographic)) = camera.get_mut("orthographic") {
        let location = || format!("{location}.orthographic");
        insert(&location, orthographic, "znear", json!(0), warnings);
        insert_invalid(&location, orthographic, "zfar", json!(0), warnings);
        for (key, other) in [("xmag", "ymag"), ("ymag", "xmag")] {
            if let Some(magnitude) = orthographic.get(other).cloned() {
                insert(&location, orthographic, key, magnitude, warnings);
            }
        }
    }
}

/// Inserts the first buffer, and the length up to the end of the buffer.
fn insert_in_buffer_views(value: &mut Value, warnings: &mut Warnings) {
    let lengths: Vec<u64> =
        objects(value, "buffers").map(|(_, buffer)| integer(buffer, "byteLength")).collect();
    for (i, view) in objects(value, "bufferViews") {
        let location = || format!("bufferViews[{i}]");
        insert(&location, view, "buffer", json!(0), warnings);
        let length = lengths.get(integer(view, "buffer") as usize).copied().unwrap_or(0);
        let rest = length.saturating_sub(integer(view, "byteOffset"));
        insert(&location, view, "byteLength", json!(rest), warnings);
    }
}

/// Inserts the number of elements that a buffer view holds. The type of the elements cannot be derived.
fn insert_in_accessors(value: &mut Value, warnings: &mut Warnings) {
    let views: Vec<Object> = objects(value, "bufferViews")
        .map(|(_, view)| {
            view.iter().filter(|(key, _)| key.starts_with("byte")).map(|(k, v)| (k.clone(), v.clone()))
        })
        .map(Map::from_iter)
        .collect();
    for (i, accessor) in objects(value, "accessors") {
        let location = || format!("accessors[{i}]");
        insert_invalid(&location, accessor, "componentType", json!(0), warnings);
        insert_invalid(&location, accessor, "type", json!(""), warnings);
        if !accessor.contains_key("count") {
            let view = accessor.get("bufferView").and_then(Value::as_u64).and_then(|v| views.get(v as usize));
            let count = view.map_or(0, |view| elements_in(accessor, view));
            insert(&location, accessor, "count", json!(count), warnings);
            if count == 0 {
                accessor.remove("sparse");
            }
        }
        if accessor.get("sparse").is_some_and(|sparse| !is_complete_sparse(sparse)) {
            warnings.add(
                format_args!("accessors[{i}].sparse"),
                "ignored sparse storage without its required properties",
            );
            accessor.remove("sparse");
        }
    }
}

fn integer(object: &Object, key: &str) -> u64 {
    object.get(key).and_then(Value::as_u64).unwrap_or(0)
}

/// Number of an accessor's elements that fit into its buffer view.
fn elements_in(accessor: &Object, view: &Object) -> u64 {
    let component = match integer(accessor, "componentType") {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        _ => return 0,
    };
    let components = match accessor.get("type").and_then(Value::as_str) {
        Some("SCALAR") => 1,
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        Some("VEC4" | "MAT2") => 4,
        Some("MAT3") => 9,
        Some("MAT4") => 16,
        _ => return 0,
    };
    let size = component * components;
    let bytes = integer(view, "byteLength").saturating_sub(integer(accessor, "byteOffset"));
    let stride = integer(view, "byteStride").max(size);
    bytes.checked_sub(size).map_or(0, |rest| rest / stride + 1)
}

fn is_complete_sparse(sparse: &Value) -> bool {
    ["/count", "/indices/bufferView", "/indices/componentType", "/values/bufferView"]
        .iter()
        .all(|path| sparse.pointer(path).is_some())
}

fn remove_light_without_index(node: &mut Object, location: &str, warnings: &mut Warnings) {
    let Some(Value::Object(extensions)) = node.get_mut("extensions") else { return };
    for name in ["KHR_lights_punctual", area_light::NAME, photometric_light::NAME] {
        if extensions.get(name).is_some_and(|body| !body.get("light").is_some_and(Value::is_u64)) {
            warnings.add(format_args!("{location}.extensions.{name}"), "ignored light without an index");
            extensions.remove(name);
        }
    }
}
