//! JSON text to a value tree, with the slips that exporters make put right.

use std::collections::HashMap;

use ::gltf::json::Root;
use serde_json::{Map, Value, json};

use super::{extensions, nonfinite, references};
use crate::import::error::{LoadError, Warnings};
use crate::import::files::escape::printable;
use crate::import::gltf::{null_members, validate};

/// What is said to files of the old format, wherever it shows.
pub(super) const VERSION_1: &str =
    "this is glTF 1.0, which is not read: convert it to glTF 2.0, with gltf-pipeline or Blender say";

/// The file's JSON, typed.
#[derive(Debug)]
pub(super) struct Json {
    /// The objects. Every index that [`references`] knows is in range, with one exception:
    /// `target.node` is `u32::MAX` where a channel names none.
    pub root: Root,
    /// KHR_animation_pointer's JSON pointers by animation and channel, but for those that drive a
    /// node as core channels do.
    pub pointers: HashMap<(usize, usize), String>,
    /// The extensions that are met in it, listed or not.
    pub extensions: extensions::Met,
}

/// Reads, repairs and types the JSON.
pub(super) fn parse(text: &[u8], warnings: &mut Warnings) -> Result<Json, LoadError> {
    if text.starts_with(b"\xff\xfe") || text.starts_with(b"\xfe\xff") || text.iter().take(4).any(|&b| b == 0)
    {
        return Err(LoadError::parse("JSON", "the text is not UTF-8 but UTF-16: save it as UTF-8"));
    }
    let text = String::from_utf8_lossy(text);
    if matches!(text, std::borrow::Cow::Owned(_)) {
        warnings.add("JSON", "bytes that are not UTF-8 were replaced");
    }
    let mut value = read(&text, warnings).map_err(|e| {
        let place = format!("JSON, line {} column {}", e.line(), e.column());
        let what = e.to_string();
        LoadError::parse(place, what.split(" at line ").next().unwrap_or(&what))
    })?;
    null_members::drop_nulls(&mut value);
    let Some(root) = value.as_object_mut() else {
        return Err(LoadError::parse("JSON", "the file holds no JSON object, so it is no glTF"));
    };
    version(root, warnings)?;
    let mut floats = Floats::default();
    floats.mend(&mut value);
    if let Some(first) = floats.first {
        let what = format!("{} integers are written as floats, and were read as integers", floats.count);
        warnings.add(first, what);
    }
    null_members::mend_labels(&mut value, warnings);
    references::check(&value)?;
    let pointers = pointers(&mut value);
    let extensions = extensions::met(&value, &pointers);
    fill(&mut value, warnings);
    validate::mend(&mut value, warnings);
    let root = serde_path_to_error::deserialize(value).map_err(|e| {
        let path = e.path().to_string();
        LoadError::parse(path, e.into_inner())
    })?;
    Ok(Json { root, pointers, extensions })
}

/// Reads JSON; text that is none once more without the numbers that JSON has not.
fn read(text: &str, warnings: &mut Warnings) -> serde_json::Result<Value> {
    serde_json::from_str(text).or_else(|error| {
        let Some(mended) = nonfinite::as_null(text) else { return Err(error) };
        let mut value = serde_json::from_str(&mended.text)?;
        null_members::drop_gaps(&mut value);
        let what = "NaN or Infinity, which JSON has not, were read as null, and numbers with them left out";
        let (line, column) = mended.first;
        warnings
            .add(format_args!("JSON, line {line} column {column}"), format_args!("{} {what}", mended.count));
        Ok(value)
    })
}

/// Judges `asset.version`, and supplies it where it is missing or a number.
fn version(root: &mut Map<String, Value>, warnings: &mut Warnings) -> Result<(), LoadError> {
    let old =
        ["meshes", "nodes", "accessors", "scenes"].iter().any(|k| root.get(*k).is_some_and(Value::is_object));
    let asset = root.entry("asset").or_insert_with(|| json!({}));
    let found = match asset.get("version") {
        Some(Value::String(s)) => Some(s.trim().to_string()),
        Some(Value::Number(n)) => Some(n.to_string()),
        _ => None,
    };
    if old || found.as_deref().is_some_and(|v| v == "1" || v.starts_with("1.") || v.starts_with("0.")) {
        return Err(LoadError::Unsupported(VERSION_1.into()));
    }
    match &found {
        None => warnings.add("asset.version", "is missing; read as glTF 2.0"),
        Some(v) if v != "2" && !v.starts_with("2.") => {
            let v = printable(v);
            return Err(LoadError::Unsupported(format!("glTF version {v} is not known; 2.0 is read")));
        }
        Some(v) => {
            if asset["version"].is_number() {
                warnings.add("asset.version", format_args!("{v} is a number, and was read as text"));
            }
        }
    }
    if !asset.is_object() {
        *asset = json!({});
    }
    asset["version"] = json!(found.unwrap_or_else(|| "2.0".into()));
    least_version(asset, warnings);
    Ok(())
}

/// Warns of a file for programs that know more than glTF 2.0: what they know is not shown.
fn least_version(asset: &mut Value, warnings: &mut Warnings) {
    let least = match asset.get("minVersion") {
        Some(Value::String(s)) => s.trim().to_string(),
        Some(Value::Number(n)) => n.to_string(),
        _ => return,
    };
    let mut parts = least.split('.').map(|part| part.parse::<u64>().unwrap_or(0));
    if (parts.next(), parts.next()) > (Some(2), Some(0)) {
        let least = printable(&least);
        warnings
            .add("asset.minVersion", format_args!("is {least}: what is newer than glTF 2.0 is not shown"));
    }
    asset["minVersion"] = json!(least);
}

/// Names of the fields that hold integers, in the core and in the extensions that are read.
const INTEGERS: &[&str] = &[
    "buffer",
    "bufferView",
    "byteLength",
    "byteOffset",
    "byteStride",
    "camera",
    "componentType",
    "count",
    "index",
    "indices",
    "input",
    "inverseBindMatrices",
    "light",
    "magFilter",
    "material",
    "mesh",
    "minFilter",
    "mode",
    "node",
    "output",
    "sampler",
    "scene",
    "skeleton",
    "skin",
    "source",
    "target",
    "texCoord",
    "wrapS",
    "wrapT",
];
/// Names of the arrays of integers.
const INTEGER_ARRAYS: &[&str] = &["nodes", "children", "joints"];
/// Names of the objects whose every value is an integer, and of arrays of such objects.
const INTEGER_MAPS: &[&str] = &["attributes", "targets"];

/// Rewrites floats such as `3.0` in integer fields.
#[derive(Default)]
struct Floats {
    count: usize,
    first: Option<String>,
}

impl Floats {
    /// The JSON parser bounds the depth, so recursion does no harm.
    fn mend(&mut self, value: &mut Value) {
        match value {
            Value::Object(object) => {
                for (key, field) in object.iter_mut().filter(|(k, _)| *k != "extras") {
                    let name = key.as_str();
                    match field {
                        Value::Number(_) if INTEGERS.contains(&name) => self.number(name, field),
                        Value::Array(items) if INTEGER_ARRAYS.contains(&name) => {
                            items.iter_mut().for_each(|i| self.number(name, i));
                            items.iter_mut().for_each(|i| self.mend(i));
                        }
                        Value::Object(map) if INTEGER_MAPS.contains(&name) => self.map(name, map),
                        Value::Array(items) if INTEGER_MAPS.contains(&name) => {
                            items.iter_mut().filter_map(Value::as_object_mut).for_each(|m| self.map(name, m));
                        }
                        other => self.mend(other),
                    }
                }
            }
            Value::Array(items) => items.iter_mut().for_each(|i| self.mend(i)),
            _ => {}
        }
    }

    fn map(&mut self, name: &str, map: &mut Map<String, Value>) {
        map.values_mut().for_each(|v| self.number(name, v));
    }

    fn number(&mut self, name: &str, value: &mut Value) {
        let whole = |f: f64| f.fract() == 0.0 && (0.0..9e15).contains(&f);
        if value.is_f64() && value.as_f64().is_some_and(whole) {
            *value = json!(value.as_f64().unwrap_or(0.0) as u64);
            self.count += 1;
            self.first.get_or_insert_with(|| name.to_string());
        }
    }
}

/// Objects under `value[key]`, each with its index.
pub(super) fn items<'v>(
    value: &'v mut Value,
    key: &str,
) -> impl Iterator<Item = (usize, &'v mut Map<String, Value>)> {
    let list = value.get_mut(key).and_then(Value::as_array_mut).map(|a| a.iter_mut()).into_iter().flatten();
    list.enumerate().filter_map(|(i, v)| v.as_object_mut().map(|o| (i, o)))
}

/// Takes KHR_animation_pointer's targets out. Those that drive a node as core channels do are
/// written as such; the others are handed back.
fn pointers(value: &mut Value) -> HashMap<(usize, usize), String> {
    let nodes = value.get("nodes").and_then(Value::as_array).map_or(0, Vec::len);
    let mut found = HashMap::new();
    for (animation, object) in items(value, "animations") {
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
                found.insert((animation, channel), pointer);
            }
        }
    }
    found
}

/// Supplies required members that files leave out without harm.
fn fill(value: &mut Value, warnings: &mut Warnings) {
    let mut supply =
        |place: String, object: &mut Map<String, Value>, key: &str, default: Value, warn: bool| {
            if !object.contains_key(key) {
                object.insert(key.into(), default);
                if warn {
                    warnings
                        .add(place, format_args!("has no '{key}', and was read as if it had none to give"));
                }
            }
        };
    for (i, scene) in items(value, "scenes") {
        // No warning: a scene need not have any.
        supply(format!("scenes[{i}]"), scene, "nodes", json!([]), false);
    }
    for (list, keys) in
        [("meshes", &["primitives"][..]), ("skins", &["joints"]), ("animations", &["channels", "samplers"])]
    {
        for (i, object) in items(value, list) {
            for key in keys {
                supply(format!("{list}[{i}]"), object, key, json!([]), true);
            }
        }
    }
    for (i, mesh) in items(value, "meshes") {
        let primitives = mesh.get_mut("primitives").and_then(Value::as_array_mut).into_iter().flatten();
        for (j, primitive) in primitives.enumerate() {
            if let Some(object) = primitive.as_object_mut() {
                let place = format!("meshes[{i}].primitives[{j}]");
                supply(place, object, "attributes", json!({}), true);
            }
        }
    }
    for (i, animation) in items(value, "animations") {
        let channels = animation.get_mut("channels").and_then(Value::as_array_mut).into_iter().flatten();
        for (j, channel) in channels.enumerate() {
            let target = channel.get_mut("target").and_then(Value::as_object_mut);
            if let Some(target) = target {
                // No warning: a channel without a node is the reader's to judge.
                let place = format!("animations[{i}].channels[{j}].target");
                supply(place.clone(), target, "node", json!(u32::MAX), false);
                supply(place, target, "path", json!("none"), false);
            }
        }
    }
    for (i, camera) in items(value, "cameras") {
        if let Some(Value::Object(perspective)) = camera.get_mut("perspective") {
            supply(format!("cameras[{i}].perspective"), perspective, "znear", json!(0), true);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (Result<Json, LoadError>, Vec<String>) {
        let mut warnings = Warnings::default();
        let json = parse(text.as_bytes(), &mut warnings);
        (json, warnings.into_vec().iter().map(ToString::to_string).collect())
    }

    #[test]
    fn integers_written_as_floats() {
        let text = r#"{"asset":{"version":2.0},"scene":0.0,"scenes":[{"nodes":[0.0]}],"nodes":[{"mesh":0.0}],
            "meshes":[{"primitives":[{"attributes":{"POSITION":0.0},"mode":4.0}]}],
            "accessors":[{"count":3.0,"componentType":5126.0,"type":"VEC3"}]}"#;
        let (json, warnings) = read(text);
        assert_eq!(json.unwrap().root.accessors[0].count.0, 3);
        let said = [
            "asset.version: 2.0 is a number, and was read as text",
            "scene: 7 integers are written as floats, and were read as integers",
        ];
        assert_eq!(warnings, said);
    }

    #[test]
    fn files_for_newer_programs_are_told_of() {
        let told = |least: &str| {
            let (json, warnings) = read(&format!(r#"{{"asset":{{"version":"2.1","minVersion":{least}}}}}"#));
            assert!(json.is_ok(), "{least}: {json:?}");
            warnings
        };
        for (least, name) in [("\"2.1\"", "2.1"), ("3.0", "3.0"), ("\"2.10\"", "2.10"), ("\"3\"", "3")] {
            let said = format!("asset.minVersion: is {name}: what is newer than glTF 2.0 is not shown");
            assert_eq!(told(least), [said]);
        }
        for least in ["\"2.0\"", "\"2\"", "2.0", "\"1.0\"", "\"new\"", "null"] {
            assert!(told(least).is_empty(), "{least}");
        }
    }

    #[test]
    fn numbers_that_json_has_not_are_null() {
        let text = r#"{"asset":{"version":"2.0","extras":{"quality":NaN}},"accessors":[{"count":1,
            "componentType":5126,"type":"SCALAR","max":[Infinity],"min":[-Infinity]}]}"#;
        let (json, warnings) = read(text);
        assert_eq!(json.unwrap().root.accessors.len(), 1);
        let said = "JSON, line 1 column 47: 3 NaN or Infinity, which JSON has not, were read as null, and \
                    numbers with them left out";
        assert_eq!(warnings, [said]);
    }

    #[test]
    fn what_is_null_is_not_there() {
        let text = r#"{"asset":{"version":"2.0","generator":null},"scene":null,"skins":null,"extensions":null,
            "extensionsUsed":null,"buffers":[{"byteLength":3,"uri":null}],"bufferViews":[{"buffer":0,
            "byteLength":3,"byteStride":null,"byteOffset":null}],"accessors":[{"count":1,"componentType":5126,
            "type":"SCALAR","normalized":null,"sparse":null,"byteOffset":null}],"images":[{"mimeType":null}],
            "samplers":[{"wrapS":null,"magFilter":null}],"textures":[{"source":0,"sampler":null}],
            "materials":[{"alphaMode":null,"alphaCutoff":null,"doubleSided":null,"emissiveFactor":null,
            "extensions":null,"pbrMetallicRoughness":{"metallicFactor":null,"baseColorTexture":{"index":0,
            "texCoord":null}}},{"pbrMetallicRoughness":null}],"meshes":[{"weights":null,"primitives":[
            {"attributes":{"POSITION":0,"NORMAL":null},"mode":null,"targets":null}]}],
            "nodes":[{"mesh":0,"translation":null,"extensions":null}]}"#;
        let (json, warnings) = read(text);
        let root = json.unwrap().root;
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!(root.materials[0].pbr_metallic_roughness.metallic_factor.0, 1.0);
        assert_eq!(root.meshes[0].primitives[0].attributes.len(), 1);
    }

    #[test]
    fn numbers_with_some_that_json_has_not_are_not_there() {
        let (json, warnings) =
            read("{\"asset\":{\"version\":\"2.0\"},\n\"nodes\":[{\"translation\":[NaN,0,1]}]}");
        assert_eq!((json.unwrap().root.nodes[0].translation, warnings.len()), (None, 1));
        assert!(warnings[0].starts_with("JSON, line 2 column 26: 1 NaN"), "{warnings:?}");
    }

    #[test]
    fn missing_members() {
        let (json, warnings) = read(r#"{"asset":{"version":"2.0"},"scenes":[{}],"animations":[{}]}"#);
        assert!(json.unwrap().root.scenes[0].nodes.is_empty());
        // A scene need not have nodes; an animation has to have channels and samplers.
        assert_eq!(warnings.len(), 2, "{warnings:?}");
    }

    #[test]
    fn pointers_to_nodes_become_core_channels() {
        let text = r#"{"asset":{"version":"2.0"},"nodes":[{}],"accessors":[{"count":1,"componentType":5126,"type":"SCALAR"}],
            "animations":[{"samplers":[{"input":0,"output":0}],"channels":[
            {"sampler":0,"target":{"path":"pointer","extensions":{"KHR_animation_pointer":{"pointer":"/nodes/0/scale"}}}},
            {"sampler":0,"target":{"path":"pointer","extensions":{"KHR_animation_pointer":{"pointer":"/materials/0/x"}}}},
            {"sampler":0,"target":{"path":"rotation"}}]}]}"#;
        let json = read(text).0.unwrap();
        let nodes: Vec<usize> =
            json.root.animations[0].channels.iter().map(|c| c.target.node.value()).collect();
        assert_eq!(nodes, [0, u32::MAX as usize, u32::MAX as usize]);
        assert_eq!(json.pointers.len(), 1);
    }

    #[test]
    fn errors_say_where() {
        let error = |text| read(text).0.unwrap_err().to_string();
        assert_eq!(error("{\"asset\":"), "JSON, line 1 column 9: EOF while parsing a value");
        assert!(error("[]").contains("no JSON object"));
        for text in [&b"\xff\xfe{\0}\0"[..], b"\xfe\xff\0{\0}", b"{\0}\0"] {
            let error = parse(text, &mut Warnings::default()).unwrap_err().to_string();
            assert!(error.contains("save it as UTF-8"), "{error}");
        }
        assert!(error(r#"{"asset":{"version":"1.0"}}"#).contains("glTF 1.0"));
        assert!(error(r#"{"meshes":{"a":{}}}"#).contains("glTF 1.0"));
        assert!(error(r#"{"asset":{"version":"3.0"}}"#).contains("version 3.0"));
        let bad = error(r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":"x"}]}"#);
        assert!(bad.starts_with("nodes[0].mesh: "), "{bad}");
    }

    #[test]
    fn extras_and_foreign_text_survive() {
        let mut text =
            br#"{"asset":{"version":"2.0","extras":{"a":[1.0,null]}},"nodes":[{"name":"caf_"}]}"#.to_vec();
        let at = text.iter().rposition(|&b| b == b'_').unwrap();
        text[at] = 0xe9;
        let mut warnings = Warnings::default();
        let json = parse(&text, &mut warnings).unwrap();
        assert_eq!(json.root.asset.extras.unwrap().get(), r#"{"a":[1.0,null]}"#);
        assert_eq!(json.root.nodes[0].name.as_deref(), Some("caf\u{fffd}"));
        assert_eq!(warnings.into_vec().len(), 1);
    }
}
