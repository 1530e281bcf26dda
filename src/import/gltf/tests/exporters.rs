//! Structures that exporters write against the specification or against expectation; docs/reference/exporters.md names
//! the programs.

use std::path::Path;

use glam::{DVec3, Vec3};
use serde_json::json;

use super::super::fixture::{Fixture, bytes_of};
use crate::{LoadOptions, load_bytes};
use blinn_scene::{PoseSettings, Reflectance, pose};

fn generator(file: &mut Fixture, name: &str) {
    file.json["asset"]["generator"] = json!(name);
}

/// VTK: colours of two triangles beside four vertices.
#[test]
fn colors_of_cells_are_ignored_with_a_warning() {
    let mut file = Fixture::empty();
    generator(&mut file, "VTK");
    let positions = file.vec3(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    let colors = file.accessor(5121, "VEC4", 2, &[255, 0, 0, 255, 0, 0, 255, 255]);
    file.json["accessors"][colors]["normalized"] = json!(true);
    let indices = file.indices(&[0, 1, 2, 0, 2, 3]);
    let attributes = json!({"POSITION": positions, "COLOR_0": colors});
    file.push("meshes", json!({"primitives": [{"attributes": attributes, "indices": indices}]}));
    file.node(json!({"mesh": 0}));
    let (scene, warnings) = file.load();
    assert_eq!((scene.meshes[0].triangles.len(), scene.meshes[0].colors.len()), (2, 0));
    let place = "meshes[0].primitives[0].attributes.COLOR_0";
    assert_eq!(warnings, [format!("{place}: ignored attribute with 2 elements for 4 vertices")]);
}

/// vtkGLTFWriter: the camera's node has the view matrix. The file says where the camera is, so it is not moved.
#[test]
fn cameras_that_look_away_stay_where_the_file_has_them() {
    let mut file = Fixture::triangle();
    generator(&mut file, "VTK");
    file.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 2, "zfar": 5}}));
    file.node(json!({"camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -3, 1]}));
    let (scene, warnings) = file.load();
    let node = &scene.nodes[scene.cameras[0].node as usize];
    assert_eq!(node.local.affine().translation, DVec3::new(0.0, 0.0, -3.0));
    assert!(warnings.is_empty(), "{warnings:?}");
}

/// three.js: an InstancedMesh whose `count` was lowered has a colour for each slot.
#[test]
fn instance_colors_beyond_the_instances_are_ignored() {
    let mut file = Fixture::triangle();
    generator(&mut file, "THREE.GLTFExporter r187");
    let translation = file.vec3(&[[0.0; 3], [2.0, 0.0, 0.0]]);
    let color = file.vec3(&[[0.0, 0.0, 1.0], [0.5, 0.0, 1.0], [1.0; 3], [1.0; 3]]);
    file.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing":
        {"attributes": {"TRANSLATION": translation, "_COLOR_0": color}}});
    let (scene, warnings) = file.load();
    let colors: Vec<_> = scene.instances.iter().map(|instance| instance.color).collect();
    assert_eq!(colors, [Some(Vec3::Z), Some(Vec3::new(0.5, 0.0, 1.0))]);
    let place = "nodes[0].extensions.EXT_mesh_gpu_instancing";
    assert_eq!(warnings, [format!("{place}: attributes differ in length; used 2 instances")]);
}

/// gltf-pipeline -d: the instances' accessor is gone.
#[test]
fn instances_without_their_accessor_are_a_warning() {
    let mut file = Fixture::triangle();
    let missing = file.json["accessors"].as_array().unwrap().len();
    file.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": missing}}});
    let loaded = file.try_load_with(&LoadOptions::default());
    let text = match &loaded {
        Ok((_, warnings)) => format!("{warnings:?}"),
        Err(error) => error.to_string(),
    };
    assert!(text.contains("nodes[0].extensions.EXT_mesh_gpu_instancing"), "{text}");
}

/// Open3D: a GLB whose only buffer is base64 in its JSON, and bounds of the index accessor that no index has.
#[test]
fn a_glb_without_a_chunk_and_with_wrong_bounds_is_read() {
    let mut file = Fixture::triangle();
    generator(&mut file, "Open3D");
    let indices = file.indices(&[0, 1, 2, 2, 1, 0]);
    file.json["accessors"][indices]["min"] = json!([0.0]);
    file.json["accessors"][indices]["max"] = json!([5.0]);
    file.primitive()["indices"] = json!(indices);
    let data = base64(&file.bin);
    file.json["buffers"][0] = json!({"byteLength": file.bin.len(),
        "uri": format!("data:application/octet-stream;base64,{data}")});
    let text = file.json.to_string();
    file.bin.clear();
    let (scene, warnings) =
        load_bytes(&file.glb_of(&text), Path::new("a.glb"), &LoadOptions::default()).unwrap();
    assert_eq!(scene.meshes[0].triangles.len(), 2);
    assert!(warnings.is_empty(), "{warnings:?}");
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let bits =
            group.iter().enumerate().fold(0, |bits, (i, &byte)| bits | u32::from(byte) << (16 - 8 * i));
        let digits = (0..4).map(|i| char::from(DIGITS[(bits >> (18 - 6 * i)) as usize & 63]));
        text.extend(digits.take(group.len() + 1).chain(std::iter::repeat_n('=', 3 - group.len())));
    }
    text
}

/// obj2gltf --metallicRoughness: the shininess as roughness.
#[test]
fn a_roughness_of_200_is_1() {
    let mut file = Fixture::triangle();
    generator(&mut file, "obj2gltf");
    file.push("materials", json!({"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 200}}));
    file.primitive()["material"] = json!(0);
    let (scene, _) = file.load();
    let material = &scene.materials[scene.meshes[0].material as usize];
    let Reflectance::MetallicRoughness { roughness, .. } = &material.reflectance else { panic!("physical") };
    assert_eq!(roughness.factor, 1.0);
}

/// cjio: normals against the winding. Lit sides stay lit, as the seen side decides.
#[test]
fn inward_normals_stay_with_the_mesh_and_are_turned_to_the_seen_side() {
    let mut file = Fixture::triangle();
    generator(&mut file, "Generated using cjio's glTF exporter");
    let normals = file.vec3(&[[0.0, 0.0, -1.0]; 3]);
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    let (scene, warnings) = file.load();
    assert!(!scene.meshes[0].keeps_normal_side, "the renderer turns them");
    assert!(warnings.is_empty(), "{warnings:?}");
}

/// CadQuery writes millimetres as metres; build123d and cascadio, with the same generator, write metres.
#[test]
fn millimetres_that_are_written_as_metres_are_scaled_on_demand() {
    let mut file = Fixture::triangle();
    generator(&mut file, "Open CASCADE Technology 7.9 [dev.opencascade.org]");
    file.json["nodes"][0]["scale"] = json!([40, 40, 40]);
    let size = |scale| {
        let options = LoadOptions { scale, ..LoadOptions::default() };
        let (scene, _) = load_bytes(&file.glb(), Path::new("a.glb"), &options).unwrap();
        pose(&scene, &PoseSettings::default()).unwrap().bounds().max.x
    };
    assert_eq!(size(None), 40.0);
    assert!((size(Some(0.001)) - 0.04).abs() < 1e-9);
}

/// OVITO: a chunk, and buffers in base64 beside it.
#[test]
fn buffers_beside_the_chunk_are_read() {
    let mut file = Fixture::triangle();
    generator(&mut file, "OVITO");
    let colors = bytes_of(&[1.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let uri = format!("data:application/octet-stream;base64,{}", base64(&colors));
    file.push("buffers", json!({"byteLength": colors.len(), "uri": uri}));
    let view = file.push("bufferViews", json!({"buffer": 1, "byteLength": colors.len()}));
    let accessor = json!({"bufferView": view, "componentType": 5126, "type": "VEC3", "count": 3});
    let accessor = file.push("accessors", accessor);
    file.primitive()["attributes"]["COLOR_0"] = json!(accessor);
    let (scene, warnings) = file.load();
    assert_eq!(scene.meshes[0].colors.len(), 3);
    assert!(warnings.is_empty(), "{warnings:?}");
}
