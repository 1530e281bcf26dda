//! Nodes and what hangs at them.

use glam::{DVec3, Vec3};
use serde_json::json;

use super::super::fixture::{Fixture, bytes_of};
use crate::import::{Limits, LoadOptions, UpAxis};
use crate::scene::pose;
use crate::scene::{AnimationChoice, FileProjection, LightKind, PoseSettings, Scene};

/// The middle of each instance's triangle in the world, at rest.
fn corners(scene: &Scene) -> Vec<DVec3> {
    let settings = PoseSettings { time: 0.0, animation: AnimationChoice::Rest, centre: Some(DVec3::ZERO) };
    let posed = pose(scene, &settings).unwrap();
    posed.instances.iter().map(|i| i.transform.affine.transform_point3(DVec3::X)).collect()
}

#[test]
fn transforms_and_shared_meshes() {
    let mut fixture = Fixture::triangle();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // A rotation of the wrong length is made a rotation.
    fixture.node(json!({"mesh": 0, "translation": [10, 0, 0], "rotation": [0, 0, 7.0 * half, 7.0 * half], "scale": [2, 2, 2]}));
    fixture.node(json!({"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]}));
    let (scene, _) = fixture.load();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 3));
    let expected = [DVec3::X, DVec3::new(10.0, 2.0, 0.0), DVec3::new(6.0, 0.0, 0.0)];
    for (found, expected) in corners(&scene).iter().zip(expected) {
        assert!(found.abs_diff_eq(expected, 1e-6), "{found} {expected}");
    }
    assert_eq!(scene.objects, ["node", "mesh", "mesh"]);
}

#[test]
fn up_z_turns_everything() {
    let mut fixture = Fixture::triangle();
    fixture.node(json!({"mesh": 0, "translation": [1, 2, 3]}));
    let (scene, _) = fixture.load_with(&LoadOptions { up: UpAxis::Z, ..LoadOptions::default() });
    assert_eq!(corners(&scene), [DVec3::X, DVec3::new(2.0, 3.0, -2.0)]);
    assert!(scene.nodes.iter().skip(1).all(|n| n.parent == Some(0)));
}

#[test]
fn instancing_makes_objects_of_copies() {
    let mut fixture = Fixture::triangle();
    let translation = fixture.vec3(&[[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 3.0]]);
    let scale = fixture.vec3(&[[1.0; 3], [2.0; 3]]);
    fixture.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing":
        {"attributes": {"TRANSLATION": translation, "SCALE": scale}}});
    let (scene, warnings) = fixture.load();
    assert_eq!(corners(&scene), [DVec3::new(1.0, 0.0, 1.0), DVec3::new(2.0, 0.0, 2.0)]);
    assert_eq!(scene.instances.iter().map(|i| i.object).collect::<Vec<_>>(), [1, 2]);
    assert_eq!((scene.objects.len(), warnings.len()), (2, 1));
}

/// As three.js writes them for an InstancedMesh.
#[test]
fn copies_have_colours_of_their_own() {
    let mut fixture = Fixture::triangle();
    let translation = fixture.vec3(&[[0.0; 3], [0.0, 0.0, 1.0]]);
    let color = fixture.vec3(&[[1.0, 0.5, 0.0], [0.0, f32::NAN, 1.0]]);
    fixture.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing":
        {"attributes": {"TRANSLATION": translation, "_COLOR_0": color}}});
    let (scene, warnings) = fixture.load();
    let colors: Vec<_> = scene.instances.iter().map(|i| i.color).collect();
    assert_eq!(colors, [Some(Vec3::new(1.0, 0.5, 0.0)), Some(Vec3::new(0.0, 1.0, 1.0))]);
    let place = "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes._COLOR_0";
    assert_eq!(warnings, [format!("{place}: 1 of its colours have numbers that are not finite, taken as 1")]);
}

#[test]
fn instances_are_counted_before_they_are_made() {
    let mut fixture = Fixture::triangle();
    fixture.node(json!({"mesh": 0}));
    let count = |limit| {
        let limits = Limits { instances: limit, ..Limits::default() };
        fixture
            .try_load_with(&LoadOptions { limits, ..LoadOptions::default() })
            .map(|(s, _)| s.instances.len())
    };
    assert_eq!(count(2).unwrap(), 2);
    assert_eq!(count(1).unwrap_err().to_string(), "instances: 2 exceeds the limit of 1");
}

#[test]
fn vertices_and_triangles_are_limited() {
    let fixture = Fixture::triangle();
    for limits in [
        Limits { vertices: 2, ..Limits::default() },
        Limits { triangles: 0, ..Limits::default() },
        Limits { nodes: 0, ..Limits::default() },
    ] {
        let options = LoadOptions { limits, ..LoadOptions::default() };
        assert!(fixture.try_load_with(&options).is_err(), "{options:?}");
    }
}

#[test]
fn cameras() {
    let mut fixture = Fixture::empty();
    fixture.push(
        "cameras",
        json!({"name": "own", "type": "perspective",
        "perspective": {"yfov": 0.5, "znear": 0.1, "aspectRatio": 1.5}}),
    );
    fixture.push(
        "cameras",
        json!({"type": "orthographic",
        "orthographic": {"xmag": -2.0, "ymag": 3.0, "znear": 0.5, "zfar": 9.0}}),
    );
    fixture.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.0, "znear": 1}}));
    for (i, name) in ["a", "b", "c"].iter().enumerate() {
        fixture.node(json!({"name": name, "camera": i}));
    }
    let (scene, warnings) = fixture.load();
    let [a, b] = &scene.cameras[..] else { panic!("{:?}", scene.cameras) };
    assert_eq!(a.projection, FileProjection::Perspective { yfov: 0.5, aspect: Some(1.5) });
    assert_eq!((a.zfar, a.name.as_str(), scene.find_camera("a")), (f64::INFINITY, "own", Some(0)));
    assert_eq!(b.projection, FileProjection::Orthographic { xmag: 2.0, ymag: 3.0 });
    assert_eq!((b.znear, b.zfar), (0.5, 9.0));
    assert_eq!(warnings, ["cameras[2]: has no view, and was left out"]);
}

#[test]
fn lights() {
    let mut fixture = Fixture::empty();
    fixture.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([
        {"type": "point", "name": "p", "color": [1, 0.5, 0], "intensity": 7, "range": 3},
        {"type": "spot", "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.5}},
        {"type": "spot"}, {"type": "directional"}, {"type": "lava"}]);
    for light in 0..5 {
        fixture.node(json!({"extensions": {"KHR_lights_punctual": {"light": light}}}));
    }
    let (scene, warnings) = fixture.load();
    let kinds: Vec<LightKind> = scene.lights.iter().map(|l| l.kind).collect();
    let spot = |inner, outer| LightKind::Spot { inner, outer };
    let quarter = std::f32::consts::FRAC_PI_4;
    assert_eq!(kinds, [LightKind::Point, spot(0.5, 0.5), spot(0.0, quarter), LightKind::Directional]);
    let p = &scene.lights[0];
    assert_eq!((p.color, p.intensity, p.range), (Vec3::new(1.0, 0.5, 0.0), 7.0, 3.0));
    assert_eq!((scene.lights[1].intensity, scene.lights[1].range), (1.0, f32::INFINITY));
    assert_eq!(warnings.len(), 1);
}

#[test]
fn hidden_nodes() {
    let mut fixture = Fixture::triangle();
    fixture.json["nodes"][0]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
    fixture.node(json!({}));
    let visible: Vec<bool> = fixture.load().0.nodes.iter().map(|n| n.visible).collect();
    assert_eq!(visible, [false, true]);
}

#[test]
fn where_a_file_comes_from() {
    let mut fixture = Fixture::triangle();
    fixture.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v5");
    fixture.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    fixture.json["extensions"]["KHR_materials_variants"]["variants"] =
        json!([{"name": "red"}, {"name": "blue"}]);
    let (scene, warnings) = fixture.load();
    assert!(scene.source.is_blender() && warnings.is_empty());
    assert_eq!(scene.source.variants, ["red", "blue"]);
    assert_eq!(scene.source.extensions, ["KHR_materials_variants"]);
    assert_eq!(scene.source.scenes, ["0"]);
}

#[test]
fn an_empty_file_is_an_empty_scene() {
    let (scene, _) = Fixture::empty().load();
    assert!(scene.nodes.is_empty() && scene.materials.is_empty());
}

#[test]
fn a_missing_buffer_of_what_is_drawn_is_an_error() {
    let mut fixture = Fixture::triangle();
    fixture.json["bufferViews"][0]["buffer"] = json!(1);
    fixture.json["buffers"].as_array_mut().unwrap().push(json!({"byteLength": 4, "uri": "no such.bin"}));
    assert!(
        fixture.error().starts_with("buffers[1].uri: 'no such.bin' cannot be read"),
        "{}",
        fixture.error()
    );
    fixture.json["buffers"][1] = json!({"byteLength": 4});
    assert_eq!(fixture.error(), "buffers[1]: has no uri, and the file has no binary chunk for it");
}

#[test]
fn buffers_in_data_uris() {
    let mut fixture = Fixture::triangle();
    let bytes = bytes_of(&[9.0f32, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 9.0]);
    let text: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
    let buffer = fixture.push("buffers", json!({"byteLength": 36, "uri": format!("data:,{text}")}));
    fixture.json["bufferViews"][0] = json!({"buffer": buffer, "byteLength": 36});
    let (scene, _) = fixture.load();
    assert_eq!(scene.meshes[0].positions[0], Vec3::new(9.0, 0.0, 0.0));
}

#[test]
fn a_camera_below_a_scale_of_0_is_named() {
    let mut fixture = Fixture::triangle();
    fixture.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}));
    fixture.node(json!({"name": "eye", "camera": 0, "scale": [0, 0, 0]}));
    let (scene, _) = fixture.load();
    let posed = crate::scene::pose(&scene, &crate::scene::PoseSettings::default()).unwrap();
    let view = crate::scene::View::default();
    let error = view.resolve(&posed, 4, 4).unwrap_err().to_string();
    assert!(error.starts_with("the file's camera 'eye' looks nowhere: "), "{error}");
    let turned = crate::scene::View { view_dir: Some(glam::DVec3::NEG_Z), ..view };
    assert!(turned.resolve(&posed, 4, 4).is_ok());
}
