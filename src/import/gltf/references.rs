//! Checks every index of the file against the array that it refers to, before anything else is read.

use serde_json::{Map, Value};

use super::json_tree::{Step, path_text};
use crate::error::LoadError;
use crate::files::escape::printable;

/// Paths of indices and the arrays that they refer to. `[]` stands for every item of an array, `{}` for every
/// value of an object.
const INDICES: &[(&str, &str)] = &[
    ("scene", "scenes"),
    ("scenes.[].nodes.[]", "nodes"),
    ("nodes.[].children.[]", "nodes"),
    ("nodes.[].mesh", "meshes"),
    ("nodes.[].skin", "skins"),
    ("nodes.[].camera", "cameras"),
    ("nodes.[].extensions.EXT_mesh_gpu_instancing.attributes.{}", "accessors"),
    ("meshes.[].primitives.[].attributes.{}", "accessors"),
    ("meshes.[].primitives.[].targets.[].{}", "accessors"),
    ("meshes.[].primitives.[].indices", "accessors"),
    ("meshes.[].primitives.[].material", "materials"),
    ("meshes.[].primitives.[].extensions.KHR_draco_mesh_compression.bufferView", "bufferViews"),
    ("meshes.[].primitives.[].extensions.KHR_materials_variants.mappings.[].material", "materials"),
    ("accessors.[].bufferView", "bufferViews"),
    ("accessors.[].sparse.indices.bufferView", "bufferViews"),
    ("accessors.[].sparse.values.bufferView", "bufferViews"),
    ("bufferViews.[].buffer", "buffers"),
    ("bufferViews.[].extensions.EXT_meshopt_compression.buffer", "buffers"),
    ("bufferViews.[].extensions.KHR_meshopt_compression.buffer", "buffers"),
    ("images.[].bufferView", "bufferViews"),
    ("textures.[].source", "images"),
    ("textures.[].sampler", "samplers"),
    ("textures.[].extensions.EXT_texture_webp.source", "images"),
    ("textures.[].extensions.KHR_texture_basisu.source", "images"),
    ("skins.[].joints.[]", "nodes"),
    ("skins.[].inverseBindMatrices", "accessors"),
    ("animations.[].samplers.[].input", "accessors"),
    ("animations.[].samplers.[].output", "accessors"),
    ("animations.[].channels.[].target.node", "nodes"),
];

/// Fails at the first index that is out of range, with its JSON path.
pub(super) fn check_indices(root: &Value) -> Result<(), LoadError> {
    let length = |value: Option<&Value>| value.and_then(Value::as_array).map_or(0, Vec::len);
    for (pattern, array) in INDICES {
        let parts: Vec<&str> = pattern.split('.').collect();
        check_path(root, &parts, &mut Vec::new(), array, length(root.get(array)))?;
    }
    const LIGHTS: &str = "extensions.KHR_lights_punctual.lights";
    let lights = root.pointer("/extensions/KHR_lights_punctual/lights");
    let light = ["nodes", "[]", "extensions", "KHR_lights_punctual", "light"];
    check_path(root, &light, &mut Vec::new(), LIGHTS, length(lights))?;
    let textures = length(root.get("textures"));
    let materials = root.get("materials").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    for (i, material) in materials.iter().enumerate() {
        check_texture_infos(material, &mut format!("materials[{i}]"), textures)?;
    }
    Ok(())
}

/// Checks all indices at the paths `parts` below `value`.
fn check_path<'v>(
    value: &'v Value,
    parts: &[&str],
    path: &mut Vec<Step<'v>>,
    array: &str,
    length: usize,
) -> Result<(), LoadError> {
    let Some((part, rest)) = parts.split_first() else {
        return match value.as_u64() {
            Some(index) if index >= length as u64 => Err(out_of_range(path_text(path), index, array, length)),
            // Values of another type are errors when the JSON is typed.
            _ => Ok(()),
        };
    };
    let mut step = |step: Step<'v>, value: &'v Value| {
        path.push(step);
        let result = check_path(value, rest, path, array, length);
        path.pop();
        result
    };
    match (*part, value) {
        ("[]", Value::Array(items)) => {
            items.iter().enumerate().try_for_each(|(i, item)| step(Step::Index(i), item))
        }
        ("{}", Value::Object(map)) => map.iter().try_for_each(|(key, item)| step(Step::Key(key), item)),
        (key, Value::Object(map)) => {
            map.get_key_value(key).map_or(Ok(()), |(k, item)| step(Step::Key(k), item))
        }
        _ => Ok(()),
    }
}

/// Checks the texture infos of a material: all objects named `…Texture`, also in extensions.
fn check_texture_infos(value: &Value, path: &mut String, textures: usize) -> Result<(), LoadError> {
    let Value::Object(map) = value else { return Ok(()) };
    for (key, field) in map.iter().filter(|(k, _)| *k != "extras") {
        let length = path.len();
        path.push('.');
        path.push_str(&printable(key));
        if key.ends_with("Texture") {
            let index = field.as_object().and_then(|m: &Map<_, _>| m.get("index")).and_then(Value::as_u64);
            if let Some(index) = index.filter(|&i| i >= textures as u64) {
                return Err(out_of_range(format!("{path}.index"), index, "textures", textures));
            }
        }
        check_texture_infos(field, path, textures)?;
        path.truncate(length);
    }
    Ok(())
}

fn out_of_range(path: String, index: u64, array: &str, length: usize) -> LoadError {
    LoadError::invalid(path, format_args!("{index} is out of range: the file has {length} {array}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn error(value: Value) -> String {
        check_indices(&value).unwrap_err().to_string()
    }

    #[test]
    fn errors_have_the_json_path() {
        let node = json!({"nodes": [{}, {"children": [0, 7]}]});
        assert_eq!(error(node), "nodes[1].children[1]: 7 is out of range: the file has 2 nodes");
        let attribute = json!({"meshes": [{"primitives": [{"attributes": {"POSITION": 3}}]}]});
        assert!(error(attribute).starts_with("meshes[0].primitives[0].attributes.POSITION: 3 "));
        let slot = json!({"materials": [{"extensions": {"X": {"sheenTexture": {"index": 1}}}}]});
        assert!(error(slot).starts_with("materials[0].extensions.X.sheenTexture.index: 1 "));
        let light = json!({"nodes": [{"extensions": {"KHR_lights_punctual": {"light": 0}}}]});
        assert!(error(light).contains("the file has 0 extensions.KHR_lights_punctual.lights"));
    }

    #[test]
    fn every_path_is_checked() {
        for (pattern, _) in INDICES {
            let value = pattern.split('.').rev().fold(json!(99), |inner, part| match part {
                "[]" => json!([inner]),
                "{}" => json!({"ANY": inner}),
                key => json!({key: inner}),
            });
            assert!(check_indices(&value).is_err(), "{pattern}");
        }
    }
}
