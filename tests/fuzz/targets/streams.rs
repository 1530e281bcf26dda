//! Compressed streams in a glTF that accepts any contents.

use std::path::Path;

use serde_json::{Value, json};

use super::gltf_fixture::Fixture;
use super::load_and_render;

/// A first byte that selects the attributes, then the stream.
pub fn draco(bytes: &[u8], folder: &Path) -> bool {
    let Some((&first, stream)) = bytes.split_first() else { return false };
    let names = ["POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0"];
    let there = names.iter().zip(0..).take(1 + usize::from(first % 4));
    let attributes: Value = there.map(|(name, id)| (name.to_string(), json!(id))).collect();
    let accessor =
        |kind: &str, component: u32| json!({"type": kind, "componentType": component, "count": 256});
    let json = json!({
        "bufferViews": [{"buffer": 0, "byteLength": stream.len()}],
        "accessors": [accessor("VEC3", 5126), accessor("VEC3", 5126), accessor("VEC2", 5126),
            accessor("VEC4", 5121), accessor("SCALAR", 5123)],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 4, "extensions":
            {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": attributes}}}]}],
    });
    look_at(json, stream, folder)
}

/// Bytes for mode, filter, stride and count, then the stream.
pub fn meshopt(bytes: &[u8], folder: &Path) -> bool {
    let Some((&[mode, filter, stride, count], stream)) = bytes.split_first_chunk() else { return false };
    let mode = ["ATTRIBUTES", "TRIANGLES", "INDICES"][usize::from(mode % 3)];
    let filter = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"][usize::from(filter % 5)];
    let packed = json!({"buffer": 0, "byteOffset": 0, "byteLength": stream.len(), "byteStride": stride,
        "count": count, "mode": mode, "filter": filter});
    // The accessor of the stream: positions, or indices of some.
    let indices = mode != "ATTRIBUTES";
    let component = if stride == 2 { 5123 } else { 5125 };
    let accessor = match indices {
        true => json!({"type": "SCALAR", "componentType": component, "count": count, "bufferView": 0}),
        false => json!({"type": "VEC3", "componentType": 5120, "count": count, "bufferView": 0}),
    };
    let attributes = json!({"POSITION": u8::from(indices)});
    let primitive = match indices {
        true => json!({"attributes": attributes, "indices": 0}),
        false => json!({"attributes": attributes}),
    };
    let json = json!({
        "bufferViews": [{"buffer": 0, "byteLength": usize::from(count) * usize::from(stride), "byteStride": stride,
            "extensions": {"KHR_meshopt_compression": packed}}],
        "accessors": [accessor, {"type": "VEC3", "componentType": 5126, "count": 65536}],
        "meshes": [{"primitives": [primitive]}],
    });
    look_at(json, stream, folder)
}

/// Renders it as a GLB with one mesh at one node.
fn look_at(parts: Value, stream: &[u8], folder: &Path) -> bool {
    let mut file = Fixture::empty().with(parts);
    file.node(json!({"mesh": 0}));
    file.bin = stream.to_vec();
    let path = folder.join("a.glb");
    std::fs::write(&path, file.glb()).unwrap();
    load_and_render(&path)
}
