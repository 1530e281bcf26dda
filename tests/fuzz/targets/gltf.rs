//! A glTF whose objects refer to each other at random, with a random buffer.

use std::path::Path;

use arbitrary::{Result, Unstructured};
use serde_json::{Map, Value, json};

use super::gltf_fixture::data_uri;

const COMPONENTS: [u32; 6] = [5120, 5121, 5122, 5123, 5125, 5126];
const TYPES: [(&str, usize); 6] =
    [("SCALAR", 1), ("VEC2", 2), ("VEC3", 3), ("VEC4", 4), ("MAT3", 9), ("MAT4", 16)];
const ATTRIBUTES: [&str; 9] =
    ["POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0", "JOINTS_0", "WEIGHTS_0", "_OWN"];
const PATHS: [&str; 6] = ["translation", "rotation", "scale", "weights", "pointer", "other"];

pub fn target(bytes: &[u8], folder: &Path) -> bool {
    let Ok(json) = document(&mut Unstructured::new(bytes)) else { return false };
    let path = folder.join("a.gltf");
    std::fs::write(&path, json.to_string()).unwrap();
    super::load_and_render(&path)
}

fn document(u: &mut Unstructured) -> Result<Value> {
    // The scene's root exists; everything else is random.
    let count = |u: &mut Unstructured| u.int_in_range(1..=5usize);
    let (accessors, meshes, nodes) = (count(u)? + 2, count(u)?, count(u)?);
    let bin = numbers_of_a_buffer(u)?;
    Ok(json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(u, 1, nodes)?}],
        "nodes": many(nodes, |i| node(u, i, nodes, meshes))?,
        "meshes": many(meshes, |_| mesh(u, accessors))?,
        "accessors": many(accessors, |i| accessor(u, i))?,
        "bufferViews": many(3, |_| view(u, bin.len()))?,
        "buffers": [{"byteLength": bin.len(),
            "uri": data_uri(&bin)}],
        "materials": many(2, |_| material(u))?,
        "textures": [{"source": 0}, {"sampler": 0}],
        "samplers": [{"wrapS": u.choose(&[10497, 33071, 33648, 5])?}],
        "images": [{"bufferView": 0}],
        "skins": many(2, |_| Ok(json!({"joints": list(u, 3, nodes)?, "inverseBindMatrices": index(u, accessors)?})))?,
        "cameras": [{"type": "perspective", "perspective": {"yfov": number(u)?, "znear": number(u)?}},
            {"type": "orthographic", "orthographic": {"xmag": number(u)?, "ymag": 1, "znear": 0, "zfar": number(u)?}}],
        "animations": many(2, |_| animation(u, accessors, nodes))?,
    }))
}

/// Floats near one, and some special values.
fn numbers_of_a_buffer(u: &mut Unstructured) -> Result<Vec<u8>> {
    const ODD: [f32; 10] = [
        0.0,
        -0.0,
        -1.0,
        1e-40,
        1e30,
        f32::MAX,
        f32::MIN_POSITIVE,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];
    let mut bin: Vec<u8> = (0..512).map(|i| if i % 4 == 3 { 0x3f } else { (i * 37) as u8 }).collect();
    for _ in 0..u.int_in_range(0..=8)? {
        let odd = if u.ratio(3u8, 4u8)? { *u.choose(&ODD)? } else { f32::from_bits(u.arbitrary()?) };
        let at = 4 * u.choose_index(bin.len() / 4)?;
        bin[at..at + 4].copy_from_slice(&odd.to_le_bytes());
    }
    Ok(bin)
}

fn many(n: usize, mut one: impl FnMut(usize) -> Result<Value>) -> Result<Vec<Value>> {
    (0..n).map(&mut one).collect()
}

/// Nearly always a valid index.
fn index(u: &mut Unstructured, n: usize) -> Result<Value> {
    Ok(match u.int_in_range(0..=99)? {
        0 => json!(n),
        1 => json!(-1),
        2 => json!(u32::MAX),
        _ => json!(u.choose_index(n)?),
    })
}

fn list(u: &mut Unstructured, most: usize, n: usize) -> Result<Vec<Value>> {
    (0..u.int_in_range(1..=most)?).map(|_| index(u, n)).collect()
}

fn number(u: &mut Unstructured) -> Result<Value> {
    Ok(match u.int_in_range(0..=12)? {
        0 => json!(0),
        1 => json!(-1),
        2 => json!(1e30),
        3 => json!(-1e-30),
        4 => json!(u64::MAX),
        5 => json!(f64::MAX),
        _ => json!(f64::from(u.arbitrary::<i8>()?) / 16.0),
    })
}

fn numbers(u: &mut Unstructured, n: usize) -> Result<Vec<Value>> {
    (0..n).map(|_| number(u)).collect()
}

fn node(u: &mut Unstructured, i: usize, nodes: usize, meshes: usize) -> Result<Value> {
    let mut node = Map::new();
    // Mostly trees: children have larger indices.
    if i + 1 < nodes && u.ratio(1u8, 2u8)? {
        let child = if u.ratio(1u8, 30u8)? { i } else { i + 1 };
        node.insert("children".into(), json!([child]));
    }
    for (name, value) in [
        ("mesh", index(u, meshes)?),
        ("skin", index(u, 2)?),
        ("camera", index(u, 2)?),
        ("translation", json!(numbers(u, 3)?)),
        ("rotation", json!(numbers(u, 4)?)),
        ("scale", json!(numbers(u, 3)?)),
        ("weights", json!(numbers(u, 2)?)),
    ] {
        if u.ratio(1u8, 3u8)? {
            node.insert(name.into(), value);
        }
    }
    Ok(node.into())
}

fn mesh(u: &mut Unstructured, accessors: usize) -> Result<Value> {
    // The first accessor holds positions.
    let mut attributes = Map::from_iter([("POSITION".to_string(), json!(0))]);
    for _ in 0..u.int_in_range(0..=2)? {
        attributes.insert(u.choose(&ATTRIBUTES)?.to_string(), index(u, accessors)?);
    }
    let mut primitive = json!({"attributes": attributes});
    for (name, value) in [
        ("indices", index(u, accessors)?),
        ("mode", json!(u.int_in_range(0..=7)?)),
        ("material", index(u, 2)?),
        ("targets", json!([{"POSITION": index(u, accessors)?}, {"NORMAL": index(u, accessors)?}])),
    ] {
        if u.ratio(1u8, 4u8)? {
            primitive[name] = value;
        }
    }
    Ok(json!({"primitives": [primitive], "weights": [number(u)?]}))
}

fn accessor(u: &mut Unstructured, i: usize) -> Result<Value> {
    let (kind, component) = match i {
        0 => ("VEC3", 5126),
        1 => ("SCALAR", 5123),
        _ => (u.choose(&TYPES)?.0, *u.choose(&COMPONENTS)?),
    };
    let mut accessor = json!({"type": kind, "componentType": component, "count": u.int_in_range(0..=9)?,
        "bufferView": index(u, 3)?});
    for (name, value) in [
        ("byteOffset", json!(4 * u.int_in_range(0..=8)?)),
        ("normalized", json!(true)),
        (
            "sparse",
            json!({"count": u.int_in_range(0..=3)?, "indices": {"bufferView": index(u, 3)?,
            "componentType": u.choose(&COMPONENTS)?}, "values": {"bufferView": index(u, 3)?}}),
        ),
    ] {
        if u.ratio(1u8, 6u8)? {
            accessor[name] = value;
        }
    }
    if u.ratio(1u8, 20u8)? {
        accessor.as_object_mut().unwrap().remove("bufferView");
    }
    Ok(accessor)
}

fn view(u: &mut Unstructured, size: usize) -> Result<Value> {
    let offset = 4 * u.int_in_range(0..=8)?;
    let length = if u.ratio(1u8, 30u8)? { size + 1 } else { size - offset };
    let mut view = json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
    if u.ratio(1u8, 4u8)? {
        view["byteStride"] = json!(4 * u.int_in_range(0..=8)?);
    }
    Ok(view)
}

fn material(u: &mut Unstructured) -> Result<Value> {
    Ok(json!({
        "alphaMode": u.choose(&["OPAQUE", "MASK", "BLEND", "blend"])?,
        "alphaCutoff": number(u)?,
        "doubleSided": u.arbitrary::<bool>()?,
        "pbrMetallicRoughness": {"baseColorFactor": numbers(u, 4)?, "roughnessFactor": number(u)?,
            "baseColorTexture": {"index": index(u, 2)?, "texCoord": u.int_in_range(0..=3)?}},
        "emissiveFactor": numbers(u, 3)?,
        "extensions": {"KHR_materials_ior": {"ior": number(u)?},
            "KHR_materials_transmission": {"transmissionFactor": number(u)?}},
    }))
}

fn animation(u: &mut Unstructured, accessors: usize, nodes: usize) -> Result<Value> {
    let channel =
        json!({"sampler": index(u, 1)?, "target": {"node": index(u, nodes)?, "path": u.choose(&PATHS)?}});
    Ok(
        json!({"channels": [channel], "samplers": [{"input": index(u, accessors)?, "output": index(u, accessors)?,
        "interpolation": u.choose(&["LINEAR", "STEP", "CUBICSPLINE"])?}]}),
    )
}
