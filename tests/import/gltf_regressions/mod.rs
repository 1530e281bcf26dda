//! Known pitfalls of glTF loaders, one test for each, from file to picture. Those of OBJ are tested beside
//! its importer.

mod textures;

use blinn::accel::{Accel, AccelSettings};
use blinn::import::{LoadOptions, load};
use blinn::integrator::{Aov, Frame};
use blinn::render::{RenderSettings, render_aovs};
use blinn::scene::{AlphaMode, LightUnits, Lighting, PoseSettings, Scene, View, pose};
use glam::{DVec3, Vec2, Vec3};
use serde_json::{Value, json};

use crate::common::gltf_fixture::Fixture;
use crate::common::load_model;

/// One triangle in z = 0 without normals, seen from +z.
fn triangle() -> Fixture {
    let mut file = Fixture::empty();
    let positions = file.vec3(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    file.push("meshes", json!({"primitives": [{"attributes": {"POSITION": positions}}]}));
    file.node(json!({"mesh": 0}));
    file
}

/// Sets the texture coordinates of the triangle's corners.
fn set_uvs(file: &mut Fixture, set: usize, uvs: [[f32; 2]; 3]) {
    let accessor = file.vec2(&uvs);
    file.attribute(&format!("TEXCOORD_{set}"), accessor);
}

fn model(name: &str) -> Scene {
    load_model(&format!("tests/gltf/{name}"))
}

/// Renders one layer of the unit square from +z, 8 × 8 pixels.
fn render_layer(scene: &Scene, aov: Aov) -> Vec<f32> {
    let posed = pose(scene, &PoseSettings::default()).unwrap();
    let (accel, _) = Accel::build(&posed, &AccelSettings::default());
    let view = View {
        view_point: Some(DVec3::new(0.5, 0.5, 3.0)),
        view_dir: Some(DVec3::NEG_Z),
        view_up: Some(DVec3::Y),
        projection: Some(blinn::scene::Projection::Orthographic),
        view_height: Some(1.0),
        ..View::default()
    };
    let (camera, _) = view.resolve(&posed, 8, 8).unwrap();
    let lit = Lighting::default().resolve(&posed, &camera);
    let frame = Frame::new(&posed, &accel, camera, &lit);
    let settings = RenderSettings { width: 8, height: 8, samples: 1, ..Default::default() };
    render_aovs(&frame, &[aov], &settings, &()).unwrap().remove(0).values
}

fn covered_pixels(scene: &Scene) -> usize {
    render_layer(scene, Aov::Mask).iter().filter(|&&m| m > 0.5).count()
}

/// The values of the first pixel in the bottom row, which the triangle covers.
fn corner(scene: &Scene, aov: Aov) -> Vec<f32> {
    let values = render_layer(scene, aov);
    let width = values.len() / 64;
    values[56 * width..57 * width].to_vec()
}

fn png(color: [u8; 4]) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let image = image::RgbaImage::from_pixel(1, 1, image::Rgba(color));
    image.write_to(&mut out, image::ImageFormat::Png).unwrap();
    out.into_inner()
}

#[test]
fn p01_draco_that_is_required_is_decoded() {
    assert_eq!(model("torus_draco_seq.glb").instanced_triangle_count(), 96);
    assert_eq!(model("ring_draco_valence.glb").instanced_triangle_count(), 1080);
}

#[test]
fn p02_meshopt_and_quantised_files_are_dequantised_with_their_morph_targets() {
    for name in ["patch_meshopt_filters.glb", "patch_pack_quantised.glb", "quantised.glb"] {
        let scene = model(name);
        let largest = scene.meshes.iter().flat_map(|m| &m.morph_targets).flat_map(|m| &m.positions);
        let largest = largest.fold(0.0f32, |a, d| a.max(d.length()));
        assert!(largest > 0.0 && largest < 1e5, "{name}: {largest}");
    }
}

#[test]
fn p03_an_accessor_without_a_buffer_view_is_zeros() {
    let mut file = triangle();
    let zeros = file.push("accessors", json!({"componentType": 5126, "type": "VEC2", "count": 3}));
    file.attribute("TEXCOORD_0", zeros);
    assert_eq!(file.load().0.meshes[0].uvs[0], [Vec2::ZERO; 3]);
}

#[test]
fn p04_names_are_percent_encoded_or_not() {
    for (on_disk, uri) in [
        ("a b.png", "a%20b.png"),
        ("a b.png", "a b.png"),
        ("a%20b.png", "a%20b.png"),
        ("ü.png", "%C3%BC.png"),
    ] {
        let mut file = triangle();
        set_uvs(&mut file, 0, [[0.0, 0.0]; 3]);
        file.push("images", json!({"uri": uri}));
        file.push("textures", json!({"source": 0}));
        file.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
        let (folder, path) = file.save();
        std::fs::write(folder.path().join(on_disk), png([255, 0, 0, 255])).unwrap();
        let (scene, warnings) = load(&path, &LoadOptions::default()).unwrap();
        assert_eq!((scene.images.len(), warnings.len()), (1, 0), "{on_disk} {warnings:?}");
    }
}

#[test]
fn p07_an_impossible_stride_is_repaired() {
    let mut file = triangle();
    file.json["bufferViews"][0]["byteStride"] = json!(4);
    let (scene, warnings) = file.load();
    assert!(
        covered_pixels(&scene) > 20 && warnings[0].starts_with("bufferViews[0].byteStride: "),
        "{warnings:?}"
    );
}

#[test]
fn p08_mirrored_nodes_flip_the_winding_order() {
    // Single-sided, so back faces are invisible.
    let mut file = triangle();
    file.json["nodes"][0] = json!({"mesh": 0, "scale": [-1, 1, 1], "translation": [1, 0, 0]});
    let scene = file.load().0;
    let normals = render_layer(&scene, Aov::Normal);
    assert!(covered_pixels(&scene) > 20);
    assert!(normals.as_chunks::<3>().0.iter().all(|n| *n == [0.0; 3] || *n == [0.0, 0.0, 1.0]));
    file.json["nodes"][0] = json!({"mesh": 0, "scale": [1, 1, -1]});
    assert_eq!(covered_pixels(&file.load().0), 0, "mirrored along z it shows its back");
}

/// Joints place a skin's vertices; its node's transform still determines the front side.
#[test]
fn p08_mirrored_nodes_flip_the_winding_order_of_skins() {
    let mut file = triangle();
    let joints = file.accessor(5121, "VEC4", 3, &[0; 12]);
    file.attribute("JOINTS_0", joints);
    let weights = file.vec4(&[[1.0, 0.0, 0.0, 0.0]; 3]);
    file.attribute("WEIGHTS_0", weights);
    file.push("skins", json!({"joints": [1]}));
    file.json["nodes"] = json!([{"mesh": 0, "skin": 0}, {"name": "joint"},
        {"scale": [-1, 1, 1], "translation": [1, 0, 0], "children": [0, 1]}]);
    file.json["scenes"][0]["nodes"] = json!([2]);
    let scene = file.load().0;
    assert!(covered_pixels(&scene) > 20);
    let normals = render_layer(&scene, Aov::GeometricNormal);
    assert!(normals.as_chunks::<3>().0.iter().all(|n| *n == [0.0; 3] || *n == [0.0, 0.0, 1.0]));
}

#[test]
fn p09_without_normals_a_mesh_is_flat() {
    let mut file = triangle();
    // A fold along x = y whose halves share vertices.
    let positions = file.vec3(&[[0.0, 0.0, 0.0], [1.0, 0.0, -1.0], [1.0, 1.0, 0.0], [0.0, 1.0, -1.0]]);
    let indices = file.accessor(5121, "SCALAR", 6, &[0, 1, 2, 0, 2, 3]);
    *file.primitive() = json!({"attributes": {"POSITION": positions}, "indices": indices});
    let normals = render_layer(&file.load().0, Aov::VertexNormal);
    let mut different: Vec<[u32; 3]> =
        normals.as_chunks::<3>().0.iter().map(|n| n.map(f32::to_bits)).collect();
    different.sort_unstable();
    different.dedup();
    assert_eq!(different.len(), 2, "two faces, two normals");
}

#[test]
fn p13_unknown_extensions_are_ignored() {
    let mut file = triangle();
    let strange = json!({"ACME_strange": {"a": [1, {"b": null}], "index": 7}});
    file.material(json!({"extensions": strange}));
    for place in ["asset", "scenes", "nodes", "meshes", "accessors", "bufferViews"] {
        let at = if place == "asset" { &mut file.json[place] } else { &mut file.json[place][0] };
        at["extensions"] = strange.clone();
    }
    file.json["extensions"] = strange;
    file.json["extensionsUsed"] = json!(["ACME_strange"]);
    let (scene, warnings) = file.load();
    assert!(covered_pixels(&scene) > 20);
    assert_eq!(warnings, ["ignored unknown extension ACME_strange"]);
}

#[test]
fn p14_only_the_channel_without_a_node_is_skipped() {
    let mut file = triangle();
    let times = file.floats("SCALAR", 1, &[0.0, 1.0]);
    let values = file.vec3(&[[0.0; 3]; 2]);
    let sampler = json!({"input": times, "output": values});
    file.push(
        "animations",
        json!({"samplers": [sampler], "channels": [
            {"sampler": 0, "target": {"path": "translation"}},
            {"sampler": 0, "target": {"path": "scale", "node": 0}}]}),
    );
    assert_eq!(file.load().0.animations[0].channels.len(), 1);
}

#[test]
fn p15_values_out_of_range_are_errors_with_their_paths() {
    let error = |change: fn(&mut Value)| {
        let mut file = triangle();
        change(&mut file.json);
        file.try_load().map(|_| ()).unwrap_err()
    };
    assert!(error(|j| j["nodes"][0]["mesh"] = json!(9)).starts_with("nodes[0].mesh: 9 is out of range"));
    assert!(error(|j| j["accessors"][0]["count"] = json!(4)).starts_with("accessors[0]: "));
    assert!(error(|j| j["accessors"][0]["count"] = json!(u64::MAX)).contains("18446744073709551615"));
    assert!(error(|j| j["accessors"][0]["byteOffset"] = json!(u64::MAX)).starts_with("accessors[0]: "));
    assert!(error(|j| j["bufferViews"][0]["byteLength"] = json!(u64::MAX)).starts_with("bufferViews[0]: "));
}

#[test]
fn p16_text_that_is_not_utf_8_is_read() {
    let mut file = triangle();
    file.json["nodes"][0]["name"] = json!("caf_");
    let (_folder, path) = file.save();
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.windows(4).position(|w| w == b"caf_").unwrap();
    bytes[at + 3] = 0xe9;
    std::fs::write(&path, bytes).unwrap();
    let (scene, warnings) = load(&path, &LoadOptions::default()).unwrap();
    assert!(covered_pixels(&scene) > 20 && warnings.len() == 1);
}

#[test]
fn p17_cycles_of_nodes_are_cut() {
    let mut file = triangle();
    file.json["nodes"][0]["children"] = json!([1]);
    file.push("nodes", json!({"children": [0]}));
    let (scene, warnings) = file.load();
    assert_eq!((scene.nodes.len(), covered_pixels(&scene) > 20), (2, true));
    assert!(warnings[0].contains("have an ancestor as a child"), "{warnings:?}");
}

/// The posed lights of a scene with this light at `node`, at z = 1 above the triangle.
fn posed_lights(light: Value, node: Value) -> Vec<blinn::scene::PosedLight> {
    let mut file = triangle();
    file.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([light]);
    let mut node = node;
    node["extensions"] = json!({"KHR_lights_punctual": {"light": 0}});
    node["translation"] = json!([0.25, 0.25, 1]);
    file.node(node);
    let scene = file.load().0;
    pose(&scene, &PoseSettings::default()).unwrap().lights(LightUnits::Unitless, 1.0)
}

#[test]
fn p18_a_spot_with_equal_cones_is_a_step() {
    let spot =
        json!({"type": "spot", "intensity": 10, "spot": {"innerConeAngle": 0.4, "outerConeAngle": 0.4}});
    let light = &posed_lights(spot, json!({}))[0];
    let at = light.position().unwrap();
    let inside = light.sample(at - Vec3::Z).attenuation;
    assert!(inside.is_finite() && inside > 0.0);
    assert_eq!(light.sample(at + Vec3::new(1.0, 0.0, -1.0)).attenuation, 0.0);
}

#[test]
fn p19_node_scale_does_not_change_lights_and_cameras() {
    let point = json!({"type": "point", "intensity": 10, "range": 5});
    let (plain, scaled) =
        (posed_lights(point.clone(), json!({})), posed_lights(point, json!({"scale": [7, 7, 7]})));
    assert_eq!((plain[0].intensity, plain[0].range), (scaled[0].intensity, scaled[0].range));
    let camera = |scale: Value| {
        let mut file = triangle();
        file.push(
            "cameras",
            json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1, "zfar": 9}}),
        );
        file.node(json!({"camera": 0, "translation": [0, 0, 3], "scale": scale}));
        let scene = file.load().0;
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        View::default().resolve(&posed, 8, 8).unwrap().0
    };
    assert_eq!(camera(json!([1, 1, 1])), camera(json!([5, 2, 3])));
}

/// A mirrored camera mirrors its picture, as in Blender and three.js.
#[test]
fn p19_a_mirrored_camera_sees_things_mirrored() {
    let camera = |scale: Value, turn: Value| {
        let mut file = triangle();
        file.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}));
        let child = file.push("nodes", json!({"camera": 0, "rotation": turn}));
        file.node(json!({"children": [child], "scale": scale, "translation": [0, 0, 3]}));
        let scene = file.load().0;
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        View::default().resolve(&posed, 8, 8).unwrap().0.basis
    };
    let straight = json!([0, 0, 0, 1]);
    let mirrored = camera(json!([-2, 2, 2]), straight.clone());
    assert_eq!((mirrored.u, mirrored.v, mirrored.w), (DVec3::NEG_X, DVec3::Y, DVec3::Z));
    assert_eq!(camera(json!([2, 3, 4]), straight.clone()), camera(json!([1, 1, 1]), straight));
    // An eighth of a turn about z, stretched along x.
    let sheared = camera(json!([3, 1, 1]), json!([0, 0, 0.382_683_43, 0.923_879_53]));
    let (u, v) = (DVec3::new(3.0, 1.0, 0.0).normalize(), DVec3::new(-3.0, 1.0, 0.0).normalize());
    assert!(sheared.u.distance(u) < 1e-6 && sheared.v.distance(v) < 1e-6 && sheared.w == DVec3::Z);
}

#[test]
fn p20_blended_faces_do_not_depend_on_the_order_in_the_file() {
    use blinn::integrator::Phong;
    use blinn::render::render;
    let picture = |order: [usize; 2]| {
        let mut file = triangle();
        file.json["materials"] = json!([
            {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 0.5]},
             "extensions": {"KHR_materials_unlit": {}}},
            {"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0, 0.5]},
             "extensions": {"KHR_materials_unlit": {}}}]);
        let primitive = json!({"attributes": {"POSITION": 0}});
        file.json["meshes"] = json!([{"primitives": [primitive]}, {"primitives": [primitive]}]);
        (file.json["nodes"], file.json["scenes"][0]["nodes"]) = (json!([]), json!([]));
        for i in order {
            file.json["meshes"][i]["primitives"][0]["material"] = json!(i);
            file.node(json!({"mesh": i, "translation": [0, 0, i]}));
        }
        let scene = file.load().0;
        assert!(scene.materials.iter().all(|m| m.alpha_mode == AlphaMode::Blend));
        let posed = pose(&scene, &PoseSettings::default()).unwrap();
        let (accel, _) = Accel::build(&posed, &AccelSettings::default());
        let view = View {
            view_point: Some(DVec3::new(0.2, 0.2, 5.0)),
            view_dir: Some(DVec3::NEG_Z),
            ..View::default()
        };
        let (camera, _) = view.resolve(&posed, 8, 8).unwrap();
        let lit = Lighting::default().resolve(&posed, &camera);
        let frame = Frame::new(&posed, &accel, camera, &lit);
        let settings = RenderSettings { width: 8, height: 8, samples: 1, ..Default::default() };
        render(&frame, &Phong::default(), &settings, &()).unwrap().colors
    };
    let colors = picture([0, 1]);
    assert!(colors.iter().any(|c| c.y > c.x && c.x > 0.0), "green over red");
    assert_eq!(colors, picture([1, 0]));
}

/// EXT_mesh_gpu_instancing: three.js's `_COLOR_0` multiplies vertex and material colours.
#[test]
fn gpu_instances_multiply_their_own_colours() {
    let mut file = triangle();
    file.material(json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 1, 1, 1]}}));
    let vertex_colors = file.vec3(&[[1.0, 0.5, 1.0]; 3]);
    file.attribute("COLOR_0", vertex_colors);
    let places = file.vec3(&[[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]]);
    let colors = file.vec3(&[[0.5, 0.25, 0.125], [1.0, 1.0, 1.0]]);
    file.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places, "_COLOR_0": colors}}});
    assert_eq!(corner(&file.load().0, Aov::Albedo), [0.25, 0.125, 0.125]);
}
