//! Bad glTF: good files with one value replaced, and broken containers.

use serde_json::{Value, json};

use super::Case;
use crate::common::model_path;
use crate::common::seed_files;

/// JSON pointers into a file with a bit of everything, and the values that replace theirs; `REMOVE` removes
/// the value.
const REMOVE: &str = "\"\u{1}\"";
const REPLACEMENTS: &[(&str, &str)] = &[
    ("/asset", REMOVE),
    ("/asset", "5"),
    ("/asset/version", REMOVE),
    ("/asset/version", "\"1.0\""),
    ("/asset/version", "\"3.0\""),
    ("/asset/version", "2"),
    ("/scene", "7"),
    ("/scene", "-1"),
    ("/scene", "\"first\""),
    ("/scenes", "{}"),
    ("/scenes/0/nodes/0", "99"),
    ("/nodes", "[]"),
    ("/nodes/0/mesh", "9"),
    ("/nodes/0/mesh", "0.5"),
    ("/nodes/0/skin", "4"),
    ("/nodes/0/children/0", "0"),
    ("/nodes/0/children/0", "17"),
    ("/nodes/0/children/0", "-3"),
    ("/nodes/0/weights", "[1, 2, 3]"),
    ("/nodes/1/camera", "3"),
    ("/nodes/1/extensions/KHR_lights_punctual/light", "5"),
    ("/nodes/1/extensions/KHR_lights_punctual", "[]"),
    ("/nodes/1/translation", "[1, 2]"),
    ("/nodes/1/translation", "[1, 2, \"3\"]"),
    ("/nodes/2/rotation", "[0, 0, 0, 0]"),
    ("/nodes/2/extensions/EXT_mesh_gpu_instancing/attributes/TRANSLATION", "99"),
    ("/nodes/2/extensions/EXT_mesh_gpu_instancing/attributes/TRANSLATION", "1"),
    ("/nodes/2/extensions/EXT_mesh_gpu_instancing/attributes", REMOVE),
    ("/nodes/3/matrix", "[1, 0, 0]"),
    ("/nodes/3/name", "[]"),
    ("/materials/0/name", "42"),
    ("/meshes/0/primitives", REMOVE),
    ("/meshes/0/primitives/0/attributes", REMOVE),
    ("/meshes/0/primitives/0/attributes/POSITION", REMOVE),
    ("/meshes/0/primitives/0/attributes/POSITION", "6"),
    ("/meshes/0/primitives/0/attributes/POSITION", "1"),
    ("/meshes/0/primitives/0/attributes/TEXCOORD_0", "0"),
    ("/meshes/0/primitives/0/attributes/TEXCOORD_0", "5"),
    ("/meshes/0/primitives/0/attributes/WEIGHTS_0", "0"),
    ("/meshes/0/primitives/0/attributes/JOINTS_0", "2"),
    ("/meshes/0/primitives/0/indices", "0"),
    ("/meshes/0/primitives/0/indices", "44"),
    ("/meshes/0/primitives/0/material", "8"),
    ("/meshes/0/primitives/0/mode", "9"),
    ("/meshes/0/primitives/0/mode", "1"),
    ("/meshes/0/primitives/0/targets/0/POSITION", "5"),
    ("/meshes/0/primitives/0/targets/0/POSITION", "50"),
    ("/skins/0/joints", "[]"),
    ("/skins/0/joints", "[77]"),
    ("/skins/0/inverseBindMatrices", "0"),
    ("/cameras/0/type", "\"fisheye\""),
    ("/cameras/0/perspective", REMOVE),
    ("/cameras/0/perspective/yfov", "0"),
    ("/cameras/0/perspective/yfov", "1e999"),
    ("/cameras/0/perspective/znear", "-1"),
    ("/extensions/KHR_lights_punctual/lights/0/type", "\"area\""),
    ("/extensions/KHR_lights_punctual/lights/0/intensity", "-5"),
    ("/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle", "4"),
    ("/materials/0/alphaMode", "\"HALF\""),
    ("/materials/0/pbrMetallicRoughness/baseColorFactor", "[1, 1]"),
    ("/materials/0/pbrMetallicRoughness", "3"),
    ("/materials/0/normalTexture", "{\"index\": 0}"),
    ("/accessors/0/componentType", "5130"),
    ("/accessors/0/componentType", "5124"),
    ("/accessors/0/type", "\"VEC5\""),
    ("/accessors/0/count", "4"),
    ("/accessors/0/count", "99999999999"),
    ("/accessors/0/count", "18446744073709551615"),
    ("/accessors/0/count", "-1"),
    ("/accessors/0/count", REMOVE),
    ("/accessors/0/bufferView", "66"),
    ("/accessors/0/byteOffset", "4"),
    ("/accessors/0/byteOffset", "18446744073709551608"),
    (
        "/accessors/0/sparse",
        "{\"count\": 9, \"indices\": {\"bufferView\": 1, \"componentType\": 5123}, \"values\": {\"bufferView\": 0}}",
    ),
    (
        "/accessors/0/sparse",
        "{\"count\": 2, \"indices\": {\"bufferView\": 0, \"componentType\": 5126}, \"values\": {\"bufferView\": 0}}",
    ),
    (
        "/accessors/0/sparse",
        "{\"count\": 2, \"indices\": {\"bufferView\": 0, \"componentType\": 5125}, \"values\": {\"bufferView\": 0}}",
    ),
    ("/bufferViews/0/buffer", "3"),
    ("/bufferViews/0/byteLength", "1000000"),
    ("/bufferViews/0/byteLength", REMOVE),
    ("/bufferViews/0/byteOffset", "18446744073709551615"),
    ("/bufferViews/0/byteStride", "3"),
    ("/bufferViews/0/byteStride", "5000"),
    (
        "/bufferViews/0/extensions",
        "{\"EXT_meshopt_compression\": {\"buffer\": 0, \"byteOffset\": 0, \"byteLength\": 36, \"byteStride\": 12, \"count\": 3, \"mode\": \"ATTRIBUTES\"}}",
    ),
    (
        "/bufferViews/0/extensions",
        "{\"EXT_meshopt_compression\": {\"buffer\": 0, \"byteOffset\": 0, \"byteLength\": 36, \"byteStride\": 12, \"count\": 3, \"mode\": \"POINTS\"}}",
    ),
    (
        "/bufferViews/0/extensions",
        "{\"EXT_meshopt_compression\": {\"buffer\": 0, \"byteOffset\": 0, \"byteLength\": 36, \"byteStride\": 12, \"count\": 99999999999999, \"mode\": \"ATTRIBUTES\"}}",
    ),
    ("/buffers/0/byteLength", "100000"),
    ("/buffers/0/uri", REMOVE),
    ("/buffers/0/uri", "\"missing.bin\""),
    ("/buffers/0/uri", "\"../outside.bin\""),
    ("/buffers/0/uri", "\"http://localhost/a.bin\""),
    ("/buffers/0/uri", "\"data:;base64,!!!\""),
    ("/buffers/0/uri", "\"data:;base64\""),
    ("/animations/0/channels/0/sampler", "9"),
    ("/animations/0/channels/0/target/path", "\"colour\""),
    ("/animations/0/channels/0/target/node", "12"),
    ("/animations/0/samplers/0/input", "40"),
    ("/animations/0/samplers/0/input", "0"),
    ("/animations/0/samplers/0/output", "1"),
    ("/animations/0/samplers/0/interpolation", "\"SMOOTH\""),
    ("/animations/0/samplers", "[]"),
    ("/extensionsRequired", "[\"EXT_unheard_of\"]"),
    ("/extensionsRequired", "\"KHR_draco_mesh_compression\""),
];

pub fn cases() -> Vec<Case> {
    let good: Value = serde_json::from_slice(&seed_files::rich_gltf()).unwrap();
    let mut all: Vec<Case> =
        REPLACEMENTS.iter().map(|(place, value)| with_value_replaced(&good, place, value)).collect();
    all.extend(texts());
    all.extend(containers(&good));
    all.extend(compressed());
    all
}

fn with_value_replaced(good: &Value, place: &str, value: &str) -> Case {
    let mut bad = good.clone();
    let (parent, key) = place.rsplit_once('/').unwrap();
    let name = format!("{} = {}", &place[1..], if value == REMOVE { "nothing" } else { value });
    match bad.pointer_mut(parent).unwrap() {
        Value::Object(map) if value == REMOVE => drop(map.remove(key).expect(place)),
        Value::Object(map) => drop(map.insert(key.into(), number(value))),
        Value::Array(list) => list[key.parse::<usize>().unwrap()] = number(value),
        _ => panic!("{place}"),
    }
    // A number that is valid in JSON and overflows f64.
    let text = bad.to_string().replace(r#""\u0002""#, "1e999");
    Case::new(name, "a.gltf", text)
}

fn number(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|_| json!("\u{2}"))
}

/// Files that are not JSON, or not quite.
fn texts() -> Vec<Case> {
    let deep = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extras\":{}", "[".repeat(100_000));
    let texts: [(&str, Vec<u8>); 9] = [
        ("an empty .gltf", b"".to_vec()),
        ("white space", b" \n ".to_vec()),
        ("a brace", b"{".to_vec()),
        ("a list", b"[1]".to_vec()),
        ("null", b"null".to_vec()),
        ("a comma too many", b"{\"asset\": {\"version\": \"2.0\",}}".to_vec()),
        ("a comment", b"{\n // why not\n\"asset\": {\"version\": \"2.0\"}}".to_vec()),
        ("a string that is no UTF-8", b"{\"asset\": {\"version\": \"\xff\"}}".to_vec()),
        ("a hundred thousand brackets", deep.into_bytes()),
    ];
    texts.into_iter().map(|(name, text)| Case::new(name, "a.gltf", text)).collect()
}

fn glb(version: u32, chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
    let mut out = [&b"glTF"[..], &version.to_le_bytes(), &[0; 4]].concat();
    for (kind, body) in chunks {
        out.extend((body.len() as u32).to_le_bytes());
        out.extend(*kind);
        out.extend(*body);
    }
    let length = out.len() as u32;
    out[8..12].copy_from_slice(&length.to_le_bytes());
    out
}

fn containers(good: &Value) -> Vec<Case> {
    let mut json = good.clone();
    json["buffers"][0].as_object_mut().unwrap().remove("uri");
    let json = json.to_string().into_bytes();
    let bin = vec![0; good["buffers"][0]["byteLength"].as_u64().unwrap() as usize];
    let whole = glb(2, &[(b"JSON", &json), (b"BIN\0", &bin)]);
    let changed = |at: usize, word: u32| {
        let mut bad = whole.clone();
        bad[at..at + 4].copy_from_slice(&word.to_le_bytes());
        bad
    };
    let files: [(&str, Vec<u8>); 15] = [
        ("GLB: the magic number alone", b"glTF".to_vec()),
        ("GLB: a header alone", whole[..12].to_vec()),
        ("GLB: half a header", whole[..9].to_vec()),
        ("GLB: half of it", whole[..whole.len() / 2].to_vec()),
        ("GLB: a byte short", whole[..whole.len() - 1].to_vec()),
        ("GLB: version 1", glb(1, &[(b"JSON", &json)])),
        ("GLB: version 3", glb(3, &[(b"JSON", &json)])),
        ("GLB: too long by its header", changed(8, u32::MAX)),
        ("GLB: too short by its header", changed(8, 20)),
        ("GLB: a JSON chunk longer than the file", changed(12, u32::MAX)),
        ("GLB: a binary chunk first", glb(2, &[(b"BIN\0", &bin), (b"JSON", &json)])),
        ("GLB: no binary chunk", glb(2, &[(b"JSON", &json)])),
        ("GLB: a short binary chunk", glb(2, &[(b"JSON", &json), (b"BIN\0", &bin[..40])])),
        ("GLB: two binary chunks", glb(2, &[(b"JSON", &json), (b"BIN\0", &bin), (b"BIN\0", &bin)])),
        ("GLB: JSON that is none", glb(2, &[(b"JSON", b"what"), (b"BIN\0", &bin)])),
    ];
    files.into_iter().map(|(name, bytes)| Case::new(name, "a.glb", bytes)).collect()
}

/// Compressed streams that contradict the file around them.
fn compressed() -> Vec<Case> {
    let whole = std::fs::read(model_path("tests/gltf/strip_draco.glb")).unwrap();
    let json = u32::from_le_bytes(whole[12..16].try_into().unwrap()) as usize;
    let stream = whole[28 + json..].to_vec();
    let json: Value = serde_json::from_slice(&whole[20..20 + json]).unwrap();
    let file = |json: &Value, stream: &[u8]| {
        let text = json.to_string();
        glb(2, &[(b"JSON", text.as_bytes()), (b"BIN\0", stream)])
    };
    let changed = |pointer: &str, value: Value| {
        let mut bad = json.clone();
        *bad.pointer_mut(pointer).unwrap() = value;
        file(&bad, &stream)
    };
    let draco = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
    let mut magic = stream.clone();
    magic[0] ^= 1;
    let files = [
        ("Draco: another magic number", file(&json, &magic)),
        ("Draco: cut off", {
            let mut zeros = stream.clone();
            let half = zeros.len() / 2;
            zeros[half..].fill(0);
            file(&json, &zeros)
        }),
        ("Draco: no such buffer view", changed(&format!("{draco}/bufferView"), json!(99))),
        ("Draco: no such attribute", changed(&format!("{draco}/attributes/POSITION"), json!(77))),
        ("Draco: no attributes", changed(&format!("{draco}/attributes"), json!(5))),
    ];
    files.into_iter().map(|(name, bytes)| Case::new(name, "a.glb", bytes)).collect()
}
