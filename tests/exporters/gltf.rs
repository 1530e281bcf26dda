//! glTF as exporters write it.

use blinn::scene::{AlphaMode, Material, PoseSettings, Reflectance, Scene, pose};
use glam::{DVec3, Vec3};
use serde_json::json;

use crate::common::gltf_fixture::{Fixture, bytes_of};

fn by(generator: &str) -> Fixture {
    let mut file = Fixture::triangle();
    file.json["asset"]["generator"] = json!(generator);
    file
}

fn load(file: &Fixture) -> Scene {
    let (scene, warnings) = file.load();
    assert!(warnings.is_empty(), "{warnings:?}");
    scene
}

fn material(scene: &Scene) -> &Material {
    &scene.materials[scene.meshes[0].material as usize]
}

/// Matrices turn actors (x to z, y to x, z to y), but neither their translations nor the camera.
#[test]
fn pyvista_turns_actors_and_not_the_camera() {
    let mut file = by("VTK");
    file.json["nodes"][0]["matrix"] = json!([0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 6, 7, 1]);
    file.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.01, "zfar": 1000}}),
    );
    file.node(json!({"camera": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]}));
    let scene = load(&file);
    let bounds = pose(&scene, &PoseSettings::default()).unwrap().bounds();
    // The triangle (0 0 0), (1 0 0), (0 1 0) becomes (0 0 0), (0 0 1), (1 0 0), moved by (5 6 7).
    assert_eq!((bounds.min, bounds.max), (DVec3::new(5.0, 6.0, 7.0), DVec3::new(6.0, 6.0, 8.0)));
    let camera = &scene.nodes[scene.cameras[0].node as usize];
    assert_eq!(camera.local.affine().translation, DVec3::new(1.0, 2.0, 3.0));
}

/// The actor's colour multiplies the texture of a colour map.
#[test]
fn pyvista_tints_color_maps() {
    let mut file = by("VTK");
    let pbr = json!({"baseColorFactor": [0.678, 0.847, 0.902, 1], "metallicFactor": 0, "roughnessFactor": 1});
    file.material(json!({"pbrMetallicRoughness": pbr}));
    assert_eq!(material(&load(&file)).base_color.factor, Vec3::new(0.678, 0.847, 0.902));
}

/// Meshes that are no metal have no highlight: their specular colour is black.
#[test]
fn playcanvas_turns_off_highlights_by_the_specular_color() {
    let mut file = by("PlayCanvas GltfExporter");
    file.json["extensionsUsed"] = json!(["KHR_materials_specular"]);
    file.material(
        json!({"pbrMetallicRoughness": {"baseColorFactor": [0.2176, 0.2176, 0.2176, 1], "metallicFactor": 0},
        "extensions": {"KHR_materials_specular": {"specularColorFactor": [0, 0, 0]}}}),
    );
    let scene = load(&file);
    let Reflectance::MetallicRoughness { dielectric, metallic, .. } = &material(&scene).reflectance else {
        panic!("physical")
    };
    assert_eq!((dielectric.specular_color.factor, metallic.factor), (Vec3::ZERO, 0.0));
}

/// Bytes are colours from 0 to 1 although `normalized` is missing, and lists without elements are no lists.
#[test]
fn loaders_gl_writes_byte_colors_without_normalized_and_empty_lists() {
    let mut file = by("loaders.gl");
    let colors = file.accessor(5121, "VEC3", 3, &[255, 0, 0, 0, 255, 0, 0, 0, 255]);
    file.attribute("COLOR_0", colors);
    for list in ["animations", "cameras", "images", "textures", "skins", "materials"] {
        file.json[list] = json!([]);
    }
    let (scene, warnings) = file.load();
    let colors: Vec<Vec3> = scene.meshes[0].colors.iter().map(|color| color.truncate()).collect();
    assert_eq!(colors, [Vec3::X, Vec3::Y, Vec3::Z]);
    assert_eq!(warnings.iter().filter(|w| w.contains("not marked as normalized")).count(), 1, "{warnings:?}");
}

/// An opacity without alphaMode is not shown, as glTF says.
#[test]
fn opacities_without_alpha_mode_are_opaque() {
    for (generator, pbr) in [
        ("VTK", json!({"baseColorFactor": [1, 1, 1, 0.5], "metallicFactor": 0.6})),
        ("FBX2glTF v0.9.7", json!({"baseColorFactor": [0.1, 0.2, 0.8, 0.78], "metallicFactor": 0.4})),
    ] {
        let mut file = by(generator);
        file.material(json!({"pbrMetallicRoughness": pbr}));
        assert_eq!(material(&load(&file)).alpha_mode, AlphaMode::Opaque, "{generator}");
    }
}

/// A colour with an opacity becomes five numbers, of which the last is 1.
#[test]
fn plot2gltf_writes_five_numbers() {
    let mut file = by("pygltflib@v1.16.5");
    let pbr =
        json!({"baseColorFactor": [0.5, 0.25, 1, 0.5, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0});
    file.material(json!({"pbrMetallicRoughness": pbr, "alphaMode": "OPAQUE", "doubleSided": true}));
    let (scene, warnings) = file.load();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("5 numbers instead of 4"), "{warnings:?}");
    assert_eq!(material(&scene).base_color.factor, Vec3::new(0.5, 0.25, 1.0));
    assert_eq!(material(&scene).alpha_mode, AlphaMode::Opaque);
}

/// Plain arrays become accessors of floats, indices too, and colours of three bytes are not padded.
#[test]
fn luma_gl_writes_indices_as_floats() {
    let mut file = by("@luma.gl/gltf");
    let colors = file.accessor(5121, "VEC3", 3, &[255, 0, 0, 0, 255, 0, 0, 0, 255]);
    file.json["accessors"][colors]["normalized"] = json!(true);
    file.attribute("COLOR_0", colors);
    let indices = file.accessor(5126, "SCALAR", 3, &bytes_of(&[2.0f32, 1.0, 0.0]));
    file.primitive()["indices"] = json!(indices);
    let (scene, _) = file.load();
    let colors: Vec<Vec3> = scene.meshes[0].colors.iter().map(|color| color.truncate()).collect();
    let corners = scene.meshes[0].triangles[0].map(|vertex| colors[vertex as usize]);
    assert_eq!(corners, [Vec3::Z, Vec3::Y, Vec3::X]);
}
