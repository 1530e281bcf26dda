//! Parsing and repairing the JSON of a glTF.

use super::super::parse::{ParsedGltf, parse};
use crate::error::{LoadError, Warnings};

fn read(text: &str) -> (Result<ParsedGltf, LoadError>, Vec<String>) {
    let mut warnings = Warnings::default();
    let json = parse(text.as_bytes(), &mut warnings);
    (json, warnings.into_lines())
}

#[test]
fn integers_with_a_decimal_point_are_converted() {
    let text = r#"{"asset":{"version":2.0},"scene":0.0,"scenes":[{"nodes":[0.0]}],"nodes":[{"mesh":0.0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0.0},"mode":4.0}]}],
        "accessors":[{"count":3.0,"componentType":5126.0,"type":"VEC3"}]}"#;
    let (json, warnings) = read(text);
    assert_eq!(json.unwrap().root.accessors[0].count.0, 3);
    let expected = [
        "asset.version: read the number 2.0 as text",
        "scene: read 7 numbers with a decimal point as integers",
    ];
    assert_eq!(warnings, expected);
}

#[test]
fn a_newer_minimum_version_is_a_warning() {
    let warnings_of = |version: &str| {
        let (json, warnings) = read(&format!(r#"{{"asset":{{"version":"2.1","minVersion":{version}}}}}"#));
        assert!(json.is_ok(), "{version}: {json:?}");
        warnings
    };
    for (version, name) in [("\"2.1\"", "2.1"), ("3.0", "3.0"), ("\"2.10\"", "2.10"), ("\"3\"", "3")] {
        let warning =
            format!("asset.minVersion: the file needs glTF {name}; ignored features newer than 2.0");
        assert_eq!(warnings_of(version), [warning]);
    }
    for version in ["\"2.0\"", "\"2\"", "2.0", "\"1.0\"", "\"new\"", "null"] {
        assert!(warnings_of(version).is_empty(), "{version}");
    }
}

#[test]
fn non_finite_numbers_are_ignored_with_a_warning() {
    let text = r#"{"asset":{"version":"2.0","extras":{"quality":NaN}},"accessors":[{"count":1,
        "componentType":5126,"type":"SCALAR","max":[Infinity],"min":[-Infinity]}]}"#;
    let (json, warnings) = read(text);
    assert_eq!(json.unwrap().root.accessors.len(), 1);
    let warning =
        "JSON, line 1 column 47: ignored 3 invalid numbers (NaN or Infinity) and the arrays with them";
    assert_eq!(warnings, [warning]);
}

#[test]
fn null_members_are_missing_members() {
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
fn arrays_with_non_finite_numbers_are_ignored() {
    let (json, warnings) =
        read("{\"asset\":{\"version\":\"2.0\"},\n\"nodes\":[{\"translation\":[NaN,0,1]}]}");
    assert_eq!((json.unwrap().root.nodes[0].translation, warnings.len()), (None, 1));
    assert!(warnings[0].starts_with("JSON, line 2 column 26: ignored 1 invalid"), "{warnings:?}");
}

#[test]
fn missing_required_members_are_inserted_with_a_warning() {
    let (json, warnings) = read(r#"{"asset":{"version":"2.0"},"scenes":[{}],"animations":[{}]}"#);
    assert!(json.unwrap().root.scenes[0].nodes.is_empty());
    // Nodes of a scene are optional; channels and samplers of an animation are required.
    assert_eq!(warnings.len(), 2, "{warnings:?}");
}

#[test]
fn pointers_to_node_transforms_become_core_channels() {
    let text = r#"{"asset":{"version":"2.0"},"nodes":[{}],"accessors":[{"count":1,"componentType":5126,"type":"SCALAR"}],
        "animations":[{"samplers":[{"input":0,"output":0}],"channels":[
        {"sampler":0,"target":{"path":"pointer","extensions":{"KHR_animation_pointer":{"pointer":"/nodes/0/scale"}}}},
        {"sampler":0,"target":{"path":"pointer","extensions":{"KHR_animation_pointer":{"pointer":"/materials/0/x"}}}},
        {"sampler":0,"target":{"path":"rotation"}}]}]}"#;
    let json = read(text).0.unwrap();
    let nodes: Vec<usize> = json.root.animations[0].channels.iter().map(|c| c.target.node.value()).collect();
    assert_eq!(nodes, [0, u32::MAX as usize, u32::MAX as usize]);
    assert_eq!(json.pointers.len(), 1);
}

#[test]
fn errors_have_a_location() {
    let error = |text| read(text).0.unwrap_err().to_string();
    assert_eq!(error("{\"asset\":"), "JSON, line 1 column 9: EOF while parsing a value");
    assert!(error("[]").contains("not an object"));
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
fn extras_and_invalid_utf8_are_kept() {
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
