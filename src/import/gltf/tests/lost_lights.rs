//! Empty nodes of Blender's files that were probably area lights.

use serde_json::{Value, json};

use super::super::fixture::Fixture;

/// A file from Blender with these nodes behind one of a triangle.
fn from_blender(nodes: &[Value]) -> Fixture {
    let mut fixture = Fixture::triangle();
    fixture.json["asset"]["generator"] = json!("Khronos glTF Blender I/O v5.0.21");
    for node in nodes {
        fixture.node(node.clone());
    }
    fixture
}

/// The rotation of an area light that points down, as Blender 5.0 exports it.
fn down() -> Value {
    json!([-0.7071068286895752, 0, 0, 0.7071068286895752])
}

#[test]
fn turned_empty_leaves_of_blender_are_lost_lights() {
    let turned = json!({"name": "Area", "rotation": down(), "translation": [0, 2, 0]});
    let mut fixture = from_blender(&[turned.clone(), json!({"name": "Empty"}), turned]);
    let (scene, warnings) = fixture.load();
    assert_eq!((scene.lost_lights, warnings), (vec![1, 3], vec![]));
    fixture.json["asset"]["generator"] = json!("THREE.GLTFExporter");
    assert!(fixture.load().0.lost_lights.is_empty());
}

#[test]
fn nodes_with_another_purpose_are_not() {
    let node = |more: Value| {
        let mut node = json!({"rotation": down()});
        node.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        node
    };
    let mut fixture = from_blender(&[
        node(json!({"children": [9]})),
        node(json!({"mesh": 0})),
        node(json!({"camera": 0})),
        node(json!({"extensions": {"KHR_lights_punctual": {"light": 0}}})),
        node(json!({"extensions": {"EXT_lights_area": {"light": 0}}})),
        node(json!({"extensions": {"KHR_audio_emitter": {"emitter": 0}}})),
        node(json!({"rotation": [0, 0, 0, 1]})),
        node(json!({})),
    ]);
    fixture.push("nodes", json!({"name": "child"}));
    fixture.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}));
    fixture.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]},
        "EXT_lights_area": {"lights": [{"type": "rect"}]}});
    // The child of node 1 is number 2 of the scene.
    assert_eq!(fixture.load().0.lost_lights, [9]);
    let mut jointed = fixture.clone();
    jointed.push("skins", json!({"joints": [8]}));
    assert!(jointed.load().0.lost_lights.is_empty());
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let places = fixture.vec3(&[[0.0; 3], [1.0; 3]]);
    fixture.push(
        "animations",
        json!({"samplers": [{"input": times, "output": places}],
            "channels": [{"sampler": 0, "target": {"node": 8, "path": "translation"}}]}),
    );
    assert!(fixture.load().0.lost_lights.is_empty());
}
