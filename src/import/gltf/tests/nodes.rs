//! Nodes with their transforms, instances, cameras and lights.

use glam::{DVec3, Vec3};
use serde_json::json;

use super::super::fixture::{Fixture, bytes_of};
use crate::{Limits, LoadOptions};
use blinn_scene::{AnimationChoice, FileProjection, LightKind, PoseSettings, Scene, UpAxis, pose};

/// World position of each instance's point (1, 0, 0), at rest.
fn instance_points(scene: &Scene) -> Vec<DVec3> {
    let settings = PoseSettings { time: 0.0, animation: AnimationChoice::Rest, centre: Some(DVec3::ZERO) };
    let posed = pose(scene, &settings).unwrap();
    posed.instances.iter().map(|i| i.transform.affine.transform_point3(DVec3::X)).collect()
}

#[test]
fn shared_meshes_are_instanced_with_their_nodes_transforms() {
    let mut fixture = Fixture::triangle();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // Quaternions are normalized.
    fixture.node(json!({"mesh": 0, "translation": [10, 0, 0], "rotation": [0, 0, 7.0 * half, 7.0 * half], "scale": [2, 2, 2]}));
    fixture.node(json!({"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]}));
    let (scene, _) = fixture.load();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 3));
    let expected = [DVec3::X, DVec3::new(10.0, 2.0, 0.0), DVec3::new(6.0, 0.0, 0.0)];
    for (point, expected) in instance_points(&scene).iter().zip(expected) {
        assert!(point.abs_diff_eq(expected, 1e-6), "{point} {expected}");
    }
    assert_eq!(scene.objects, ["node", "mesh", "mesh"]);
}

#[test]
fn up_z_rotates_the_whole_scene() {
    let mut fixture = Fixture::triangle();
    fixture.node(json!({"mesh": 0, "translation": [1, 2, 3]}));
    let (scene, _) = fixture.load_with(&LoadOptions { up: Some(UpAxis::Z), ..LoadOptions::default() });
    assert_eq!(instance_points(&scene), [DVec3::X, DVec3::new(2.0, 3.0, -2.0)]);
    assert!(scene.nodes.iter().skip(1).all(|n| n.parent == Some(0)));
}

#[test]
fn each_gpu_instance_is_an_object() {
    let mut fixture = Fixture::triangle();
    let translation = fixture.vec3(&[[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 3.0]]);
    let scale = fixture.vec3(&[[1.0; 3], [2.0; 3]]);
    fixture.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing":
        {"attributes": {"TRANSLATION": translation, "SCALE": scale}}});
    let (scene, warnings) = fixture.load();
    assert_eq!(instance_points(&scene), [DVec3::new(1.0, 0.0, 1.0), DVec3::new(2.0, 0.0, 2.0)]);
    assert_eq!(scene.instances.iter().map(|i| i.object).collect::<Vec<_>>(), [1, 2]);
    assert_eq!((scene.objects.len(), warnings.len()), (2, 1));
}

/// `_COLOR_0` as three.js writes it for an InstancedMesh.
#[test]
fn gpu_instances_have_colours() {
    let mut fixture = Fixture::triangle();
    let translation = fixture.vec3(&[[0.0; 3], [0.0, 0.0, 1.0]]);
    let color = fixture.vec3(&[[1.0, 0.5, 0.0], [0.0, f32::NAN, 1.0]]);
    fixture.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing":
        {"attributes": {"TRANSLATION": translation, "_COLOR_0": color}}});
    let (scene, warnings) = fixture.load();
    let colors: Vec<_> = scene.instances.iter().map(|i| i.color).collect();
    assert_eq!(colors, [Some(Vec3::new(1.0, 0.5, 0.0)), Some(Vec3::new(0.0, 1.0, 1.0))]);
    let location = "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes._COLOR_0";
    assert_eq!(warnings, [format!("{location}: 1 colours have non-finite components; used 1")]);
}

#[test]
fn instances_are_limited() {
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
fn cameras_are_read_and_invalid_ones_ignored() {
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
    assert_eq!(warnings, ["cameras[2]: ignored camera without a valid projection"]);
}

#[test]
fn lights_are_read_and_unknown_types_ignored() {
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

/// Blender's exporter writes custom properties of lights into `extras`.
#[test]
fn radii_of_lights_are_read_from_extras() {
    let mut fixture = Fixture::empty();
    let light = |kind: &str, extras: serde_json::Value| json!({"type": kind, "extras": extras});
    let lights = [
        (light("point", json!({"shadow_soft_size": 0.25, "angle": 1})), 0.25),
        (light("spot", json!({"radius": 0.5})), 0.5),
        (light("directional", json!({"angle": 0.2, "radius": 3})), 0.1f32.tan()),
        (light("point", json!({"radius": -1})), 0.0),
        (light("point", json!({"radius": 1e300})), 0.0),
        (light("directional", json!({"angle": 3.2})), 0.0),
        (light("point", json!({"radius": "wide"})), 0.0),
        (light("point", json!([0.5])), 0.0),
        (light("point", json!(null)), 0.0),
        (json!({"type": "point"}), 0.0),
    ];
    fixture.json["extensions"]["KHR_lights_punctual"]["lights"] =
        lights.iter().map(|(light, _)| light.clone()).collect();
    for i in 0..lights.len() {
        fixture.node(json!({"extensions": {"KHR_lights_punctual": {"light": i}}}));
    }
    let (scene, warnings) = fixture.load();
    for (light, (json, expected)) in scene.lights.iter().zip(&lights) {
        assert!((light.radius - expected).abs() < 1e-7, "{json}: {}", light.radius);
    }
    let invalid = |i: usize, name: &str, value: &str| {
        format!("extensions.KHR_lights_punctual.lights[{i}].extras.{name}: ignored invalid value {value}")
    };
    let long = format!("1{}", "0".repeat(300));
    let expected = [invalid(3, "radius", "-1"), invalid(4, "radius", &long), invalid(5, "angle", "3.2")];
    assert_eq!(warnings, expected);
    let posed = blinn_scene::pose(&scene, &Default::default()).unwrap();
    assert_eq!(posed.lights(blinn_scene::LightUnits::Raw, 1.0)[0].radius, 0.25);
}

#[test]
fn node_visibility_is_read() {
    let mut fixture = Fixture::triangle();
    fixture.json["nodes"][0]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
    fixture.node(json!({}));
    let visible: Vec<bool> = fixture.load().0.nodes.iter().map(|n| n.visible).collect();
    assert_eq!(visible, [false, true]);
}

#[test]
fn generator_variants_extensions_and_scenes_are_recorded() {
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
fn a_missing_buffer_of_a_drawn_mesh_is_an_error() {
    let mut fixture = Fixture::triangle();
    fixture.json["bufferViews"][0]["buffer"] = json!(1);
    fixture.json["buffers"].as_array_mut().unwrap().push(json!({"byteLength": 4, "uri": "no such.bin"}));
    assert!(
        fixture.error().starts_with("buffers[1].uri: 'no such.bin' cannot be read"),
        "{}",
        fixture.error()
    );
    fixture.json["buffers"][1] = json!({"byteLength": 4});
    assert_eq!(fixture.error(), "buffers[1]: has neither a uri nor a GLB binary chunk");
}

#[test]
fn buffers_are_read_from_data_uris() {
    let mut fixture = Fixture::triangle();
    let bytes = bytes_of(&[9.0f32, 0.0, 0.0, 0.0, 9.0, 0.0, 0.0, 0.0, 9.0]);
    let text: String = bytes.iter().map(|b| format!("%{b:02x}")).collect();
    let buffer = fixture.push("buffers", json!({"byteLength": 36, "uri": format!("data:,{text}")}));
    fixture.json["bufferViews"][0] = json!({"buffer": buffer, "byteLength": 36});
    let (scene, _) = fixture.load();
    assert_eq!(scene.meshes[0].positions[0], Vec3::new(9.0, 0.0, 0.0));
}

#[test]
fn a_camera_with_a_scale_of_0_is_an_error_that_names_it() {
    let mut fixture = Fixture::triangle();
    fixture.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}));
    fixture.node(json!({"name": "eye", "camera": 0, "scale": [0, 0, 0]}));
    let (scene, _) = fixture.load();
    let posed = blinn_scene::pose(&scene, &blinn_scene::PoseSettings::default()).unwrap();
    let view = blinn_scene::View::default();
    let error = view.resolve(&posed, 4, 4).unwrap_err().to_string();
    assert!(error.starts_with("the file's camera 'eye' has no view direction: "), "{error}");
    let with_direction = blinn_scene::View { view_dir: Some(glam::DVec3::NEG_Z), ..view };
    assert!(with_direction.resolve(&posed, 4, 4).is_ok());
}
