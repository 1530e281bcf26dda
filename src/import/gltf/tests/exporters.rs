//! Structures that exporters write against the specification or against expectation; docs/reference/exporters.md names
//! the programs.

use std::path::Path;

use glam::{DVec3, Vec3, Vec4};
use serde_json::json;

use super::super::fixture::{Fixture, bytes_of};
use crate::{LoadOptions, load_bytes};
use blinn_scene::{PoseSettings, Reflectance, pose};

fn generator(file: &mut Fixture, name: &str) {
    file.json["asset"]["generator"] = json!(name);
}

/// A square of two triangles with `colors` elements in COLOR_0.
fn square_with_colors(colors: &[[u8; 4]]) -> Fixture {
    let mut file = Fixture::empty();
    generator(&mut file, "VTK");
    let positions = file.vec3(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    let colors = file.accessor(5121, "VEC4", colors.len(), colors.as_flattened());
    file.json["accessors"][colors]["normalized"] = json!(true);
    let indices = file.indices(&[0, 1, 2, 0, 2, 3]);
    let attributes = json!({"POSITION": positions, "COLOR_0": colors});
    file.push("meshes", json!({"primitives": [{"attributes": attributes, "indices": indices}]}));
    file.node(json!({"mesh": 0}));
    file
}

const RED: [u8; 4] = [255, 0, 0, 255];
const BLUE: [u8; 4] = [0, 0, 255, 255];

/// VTK: colours of cells, one for each of two triangles.
#[test]
fn colors_of_triangles_are_shown_per_triangle() {
    let (scene, warnings) = square_with_colors(&[RED, BLUE]).load();
    let mesh = &scene.meshes[0];
    // The two vertices of the shared edge occur twice.
    assert_eq!((mesh.triangles.len(), mesh.positions.len(), mesh.colors.len()), (2, 6, 6));
    for (triangle, color) in
        mesh.triangles.iter().zip([Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0)])
    {
        assert_eq!(triangle.map(|v| mesh.colors[v as usize]), [color; 3]);
    }
    let position = |v: u32| mesh.positions[v as usize];
    assert_eq!(mesh.triangles[1].map(position), [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    let place = "meshes[0].primitives[0].attributes.COLOR_0";
    assert_eq!(warnings, [format!("{place}: has a colour for each of the 2 triangles, not for each vertex")]);
    // Triangles of one colour share their vertices.
    assert_eq!(square_with_colors(&[RED, RED]).load().0.meshes[0].positions.len(), 4);
}

/// A closed mesh has more triangles than vertices: here eight of six vertices, beside three unused ones.
#[test]
fn colors_of_more_triangles_than_vertices_are_shown_per_triangle() {
    let mut file = Fixture::empty();
    let tips = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [-1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, -1.0],
    ];
    let positions = file.vec3(&tips);
    let normals = file.vec3(&tips);
    let tip = |i: u16, k: u16| k + 3 * (i >> k & 1);
    let faces: Vec<u16> = (0..8).flat_map(|i| [tip(i, 0), tip(i, 1), tip(i, 2)]).collect();
    let indices = file.indices(&faces);
    let colors: Vec<[f32; 3]> = (0..8).map(|i| [i as f32 / 8.0, 0.5, 1.0]).collect();
    let colors = file.vec3(&colors);
    let attributes = json!({"POSITION": positions, "NORMAL": normals, "COLOR_0": colors});
    file.push("meshes", json!({"primitives": [{"attributes": attributes, "indices": indices}]}));
    file.node(json!({"mesh": 0}));
    let (scene, _) = file.load();
    let mesh = &scene.meshes[0];
    assert_eq!((mesh.positions.len(), mesh.normals.len()), (24, 24));
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        assert_eq!(triangle.map(|v| mesh.colors[v as usize].x), [i as f32 / 8.0; 3]);
        // Normals stay those of the vertices.
        assert!(triangle.iter().all(|&v| mesh.normals[v as usize] == mesh.positions[v as usize]));
    }
}

/// Neither one for each triangle nor for each vertex.
#[test]
fn colors_of_neither_triangles_nor_vertices_are_ignored_with_a_warning() {
    let (scene, warnings) = square_with_colors(&[RED, BLUE, RED]).load();
    assert_eq!((scene.meshes[0].triangles.len(), scene.meshes[0].colors.len()), (2, 0));
    let place = "meshes[0].primitives[0].attributes.COLOR_0";
    assert_eq!(warnings, [format!("{place}: ignored attribute with 3 elements for 4 vertices")]);
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

/// Some programs write meshes without materials and show them matte; others mean glTF's default, a metal.
#[test]
fn meshes_without_materials_are_matte_where_the_program_shows_them_so() {
    let metallic = |name: &str, has_material: bool| {
        let mut file = Fixture::triangle();
        generator(&mut file, name);
        if has_material {
            file.push("materials", json!({}));
            file.primitive()["material"] = json!(0);
        }
        let (scene, _) = file.load();
        let material = &scene.materials[scene.meshes[0].material as usize];
        let Reflectance::MetallicRoughness { metallic, roughness, .. } = &material.reflectance else {
            panic!("physical")
        };
        assert_eq!((material.base_color.factor, roughness.factor), (Vec3::ONE, 1.0));
        metallic.factor
    };
    for name in
        ["https://github.com/mikedh/trimesh", "Open3D", "pygltflib, fury", "jscad-plan-to-gltf", "kulisse 1"]
    {
        assert_eq!((metallic(name, false), metallic(name, true)), (0.0, 1.0), "{name}");
    }
    for name in ["", "VTK", "Some Exporter v1.0"] {
        assert_eq!(metallic(name, false), 1.0, "{name}");
    }
}
