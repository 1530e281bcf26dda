//! Null, NaN and numbers that overflow f32 where glTF expects numbers and indices.

use glam::Vec3;
use serde_json::{Value, json};

use super::super::fixture::{Fixture, bytes_of};
use super::animation::skinned;
use super::malformed::rich;
use super::materials::textured;
use blinn_scene::PoseSettings;
use blinn_scene::{Scene, pose};

/// Loads a fixture with null, NaN and 1e39 in turn at `path`, which must exist or be appendable.
fn with_each_gap(fixture: &Fixture, path: &str, mut check: impl FnMut(&Scene, &[String])) {
    for gap in ["null", "NaN", "1e39", "-Infinity"] {
        let mut fixture = fixture.clone();
        *fixture.json.pointer_mut(path).unwrap_or_else(|| panic!("{path}")) = json!("@");
        let (scene, warnings) =
            fixture.load_replaced("\"@\"", gap).unwrap_or_else(|e| panic!("{gap} at {path}: {e}"));
        check(&scene, &warnings);
    }
}

#[test]
fn transforms_with_null_are_those_by_default() {
    let mut fixture = Fixture::triangle();
    let node = fixture.json["nodes"][0].clone();
    for (key, value) in [
        ("translation", json!([1, 2, 3])),
        ("rotation", json!([0, 0, 0, 1])),
        ("scale", json!([1, 1, 1])),
        ("matrix", json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])),
    ] {
        fixture.json["nodes"][0] = node.clone();
        fixture.json["nodes"][0][key] = value;
        with_each_gap(&fixture, &format!("/nodes/0/{key}/1"), |scene, warnings| {
            let posed = pose(scene, &PoseSettings::default()).unwrap();
            assert_eq!(posed.positions(0)[1], Vec3::X);
            assert_eq!(warnings.len(), 1, "{warnings:?}");
        });
    }
}

#[test]
fn null_weights_are_0_and_leave_the_others_in_place() {
    let mut fixture = Fixture::triangle();
    let up = fixture.vec3(&[[0.0, 0.0, 1.0]; 3]);
    fixture.primitive()["targets"] = json!([{"POSITION": up}, {"POSITION": up}]);
    for owner in ["meshes", "nodes"] {
        let mut fixture = fixture.clone();
        fixture.json[owner][0]["weights"] = json!([1, 0.5]);
        with_each_gap(&fixture, &format!("/{owner}/0/weights/0"), |scene, warnings| {
            let posed = pose(scene, &PoseSettings::default()).unwrap();
            assert_eq!(posed.positions(0)[0].z, 0.5, "{warnings:?}");
            assert_eq!(warnings.len(), 1, "{warnings:?}");
        });
    }
}

#[test]
fn null_indices_of_nodes_are_left_out() {
    let mut fixture = Fixture::triangle();
    fixture.json["nodes"][0]["children"] = json!([1, 2]);
    fixture.push("nodes", json!({"mesh": 0}));
    fixture.push("nodes", json!({"mesh": 0}));
    with_each_gap(&fixture, "/nodes/0/children/0", |scene, warnings| {
        assert_eq!((scene.instances.len(), warnings.len()), (2, 1), "{warnings:?}");
    });
    fixture.json["scenes"][0]["nodes"] = json!([1, 2]);
    with_each_gap(&fixture, "/scenes/0/nodes/1", |scene, warnings| {
        assert_eq!((scene.instances.len(), warnings.len()), (1, 1), "{warnings:?}");
    });
}

#[test]
fn a_null_joint_keeps_the_positions_of_the_others() {
    let fixture = skinned();
    with_each_gap(&fixture, "/skins/0/joints/0", |scene, warnings| {
        assert_eq!((&scene.skins[0].joints[..], warnings.len()), (&[2, 2][..], 1), "{warnings:?}");
    });
}

#[test]
fn null_in_accessors_and_buffer_views_is_derived() {
    let mut fixture = Fixture::triangle();
    fixture.json["accessors"][0]["min"] = json!([0, 0, 0]);
    fixture.json["accessors"][0]["max"] = json!([1, 1, 0]);
    fixture.json["accessors"][0]["byteOffset"] = json!(0);
    // The last view of the buffer, without a byteLength, extends to its end.
    for path in [
        "/accessors/0/count",
        "/accessors/1/count",
        "/accessors/0/min/0",
        "/accessors/0/max/2",
        "/accessors/0/byteOffset",
        "/bufferViews/0/buffer",
        "/bufferViews/0/byteOffset",
        "/bufferViews/1/byteLength",
    ] {
        with_each_gap(&fixture, path, |scene, warnings| {
            assert_eq!(scene.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y], "{path}");
            assert_eq!(scene.meshes[0].normals, [Vec3::Z; 3], "{path}");
            let is_optional = path.ends_with("byteOffset");
            assert!(is_optional || !warnings.is_empty(), "{path} {warnings:?}");
        });
    }
    // The buffer's length is that of the binary chunk.
    let (scene, warnings) = fixture
        .load_replaced("\"buffers\":[{\"byteLength\":72}]", "\"buffers\":[{\"byteLength\":null}]")
        .unwrap();
    assert_eq!((scene.meshes[0].positions.len(), warnings.len()), (3, 1), "{warnings:?}");
}

#[test]
fn incomplete_sparse_storage_is_ignored() {
    let mut fixture = Fixture::triangle();
    let at = fixture.view(&[1]);
    let value = fixture.view(&bytes_of(&[9.0f32, 9.0, 9.0]));
    fixture.json["accessors"][0]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": at, "componentType": 5121}, "values": {"bufferView": value}});
    for path in ["count", "indices/bufferView", "indices/componentType", "values/bufferView"] {
        with_each_gap(&fixture, &format!("/accessors/0/sparse/{path}"), |scene, warnings| {
            assert_eq!(scene.meshes[0].positions[1], Vec3::X);
            let warning = "accessors[0].sparse: ignored sparse storage without its required properties";
            assert!(warnings.iter().any(|w| w == warning), "{warnings:?}");
        });
    }
}

#[test]
fn null_in_extensions_that_are_shown_is_a_default() {
    let mut fixture = Fixture::triangle();
    fixture.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([{"type": "spot", "color": [1, 0, 0], "intensity": 5, "range": 3, "spot": {"outerConeAngle": 0.5}}]);
    fixture.node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
    let light = "/extensions/KHR_lights_punctual/lights/0";
    with_each_gap(&fixture, &format!("{light}/color/0"), |scene, warnings| {
        assert_eq!((scene.lights[0].color, warnings.len()), (Vec3::ONE, 1), "{warnings:?}");
    });
    for path in ["intensity", "range", "spot/outerConeAngle"] {
        with_each_gap(&fixture, &format!("{light}/{path}"), |scene, _| assert_eq!(scene.lights.len(), 1));
    }
    with_each_gap(&fixture, "/nodes/1/extensions/KHR_lights_punctual/light", |scene, warnings| {
        assert!(scene.lights.is_empty() && !warnings.is_empty());
    });
    let mut fixture = Fixture::triangle();
    fixture.primitive()["material"] = json!(0);
    fixture.push(
        "materials",
        json!({"emissiveFactor": [1, 1, 1], "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]},
        "extensions": {"KHR_materials_specular": {"specularColorFactor": [1, 0, 0]},
            "KHR_materials_volume": {"attenuationColor": [1, 0, 0], "thicknessFactor": 1}}}),
    );
    for path in [
        "emissiveFactor/0",
        "pbrMetallicRoughness/baseColorFactor/3",
        "extensions/KHR_materials_specular/specularColorFactor/2",
        "extensions/KHR_materials_volume/attenuationColor/1",
    ] {
        with_each_gap(&fixture, &format!("/materials/0/{path}"), |scene, warnings| {
            assert_eq!((scene.materials.len(), warnings.len()), (1, 1), "{path} {warnings:?}");
        });
    }
}

#[test]
fn null_in_textures_instances_and_visibility_is_a_default() {
    let mut fixture =
        textured(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 0,
        "extensions": {"KHR_texture_transform": {"offset": [1, 2], "scale": [3, 4], "rotation": 5}}}}}));
    let transform = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform";
    for path in ["offset/1", "scale/0", "rotation"] {
        with_each_gap(&fixture, &format!("{transform}/{path}"), |scene, _| {
            assert!(scene.materials[0].base_color.texture.is_some(), "{path}");
        });
    }
    with_each_gap(&fixture, "/materials/0/pbrMetallicRoughness/baseColorTexture/index", |scene, warnings| {
        assert!(scene.materials[0].base_color.texture.is_none() && !warnings.is_empty());
    });
    let copies = fixture.vec3(&[[0.0; 3], [1.0; 3]]);
    fixture.node(json!({"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": true},
        "EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": copies, "SCALE": copies}}}}));
    for path in ["KHR_node_visibility/visible", "EXT_mesh_gpu_instancing/attributes/SCALE"] {
        with_each_gap(&fixture, &format!("/nodes/1/extensions/{path}"), |scene, _| {
            assert_eq!((scene.instances.len(), scene.nodes[1].visible), (3, true), "{path}");
        });
    }
}

#[test]
fn null_objects_are_empty_objects() {
    for path in [
        "nodes/1",
        "materials/0",
        "meshes/1",
        "skins/0",
        "images/0",
        "textures/0",
        "samplers/0",
        "cameras/0",
        "animations/0",
        "accessors/2",
        "bufferViews/2",
        "buffers/1",
        "scenes/1",
    ] {
        let mut fixture = Fixture::triangle();
        let (array, index) = path.split_once('/').unwrap();
        assert_eq!(fixture.push(array, Value::Null).to_string(), index);
        let (scene, warnings) = fixture.load();
        assert_eq!(scene.instanced_triangle_count(), 1, "{path}");
        assert!(warnings.iter().any(|w| w.starts_with(array)), "{path} {warnings:?}");
    }
}

#[test]
fn an_animation_with_null_indices_loses_only_those_channels() {
    let fixture = rich();
    for path in ["channels/0/sampler", "samplers/0/input", "samplers/0/output"] {
        with_each_gap(&fixture, &format!("/animations/0/{path}"), |scene, warnings| {
            assert!(scene.animations[0].channels.is_empty(), "{path}");
            assert!(
                warnings.iter().any(|w| w.starts_with("animations[0].channels[0]: ignored")),
                "{warnings:?}"
            );
        });
    }
    let mut fixture = rich();
    let channel = fixture.json["animations"][0]["channels"][0].clone();
    fixture.json["animations"][0]["channels"] = json!([null, channel]);
    assert_eq!(fixture.load().0.animations[0].channels.len(), 1);
}

/// Only the type of an accessor's elements cannot be repaired.
#[test]
fn every_number_may_be_null() {
    fn paths(value: &Value, path: String, out: &mut Vec<String>) {
        match value {
            Value::Object(map) => map.iter().for_each(|(k, v)| paths(v, format!("{path}/{k}"), out)),
            Value::Array(list) => {
                list.iter().enumerate().for_each(|(i, v)| paths(v, format!("{path}/{i}"), out));
            }
            Value::Number(_) => out.push(path),
            _ => {}
        }
    }
    let fixture = rich();
    let mut all = Vec::new();
    paths(&fixture.json, String::new(), &mut all);
    let mut failed = Vec::new();
    for path in &all {
        for gap in ["null", "NaN"] {
            let mut fixture = fixture.clone();
            *fixture.json.pointer_mut(path).unwrap() = json!("@");
            if path == "/buffers/0/byteLength" {
                continue;
            }
            if let Err(error) = fixture.load_replaced("\"@\"", gap) {
                failed.push(format!("{path}: {error}"));
            }
        }
    }
    assert!(all.len() > 50);
    failed.retain(|line| !line.contains("componentType"));
    assert_eq!(failed, Vec::<String>::new());
}
