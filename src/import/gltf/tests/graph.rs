//! The scene graph: order, shared nodes, cycles and the choice of the scene.

use serde_json::{Value, json};

use super::super::fixture::Fixture;
use crate::import::SceneChoice;

fn graph(nodes: Value, roots: Value) -> Fixture {
    let mut fixture = Fixture::empty();
    fixture.json["nodes"] = nodes;
    fixture.json["scenes"][0]["nodes"] = roots;
    fixture
}

fn names(fixture: &Fixture) -> Vec<String> {
    fixture.load().0.nodes.iter().map(|n| n.name.clone()).collect()
}

#[test]
fn nodes_are_in_depth_first_file_order() {
    let nodes = json!([{"name": "a", "children": [3, 2]}, {"name": "b"}, {"name": "c"}, {"name": "d", "children": [4]}, {"name": "e"}]);
    assert_eq!(names(&graph(nodes, json!([1, 0]))), ["b", "a", "d", "e", "c"]);
}

#[test]
fn a_cycle_is_an_error_with_its_node() {
    let nodes = json!([{"children": [1]}, {"name": "loop", "children": [2]}, {"children": [1]}]);
    let error = graph(nodes, json!([0])).error();
    assert_eq!(error, "nodes[2].children: node 1 ('loop') is its own descendant; remove the cycle");
    assert!(graph(json!([{"children": [0]}]), json!([0])).error().contains("own descendant"));
}

#[test]
fn shared_nodes_are_repeated_after_their_paths_are_counted() {
    let diamond = json!([{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {"name": "shared"}]);
    let (scene, warnings) = graph(diamond, json!([0])).load();
    assert_eq!(scene.nodes.iter().filter(|n| n.name == "shared").count(), 2);
    assert!(warnings[0].starts_with("nodes[3]: 1 nodes have several parents"), "{warnings:?}");
    let doubling = |n: usize| (0..n).map(|i| json!({"children": [i + 1, i + 1]})).chain([json!({})]);
    for levels in [40, 80] {
        let error = graph(doubling(levels).collect(), json!([0])).error();
        assert!(error.contains("exceeds the limit"), "{error}");
    }
}

#[test]
fn chains_of_100000_nodes_are_loaded() {
    let nodes: Vec<Value> =
        (1..100_000).map(|i| json!({"children": [i], "translation": [1, 0, 0]})).chain([json!({})]).collect();
    let (scene, _) = graph(json!(nodes), json!([0])).load();
    assert_eq!(scene.nodes.len(), 100_000);
}

#[test]
fn scenes_are_selected_by_name_then_index() {
    let mut fixture = graph(json!([{"name": "a"}, {"name": "b"}, {"name": "c"}]), json!([0]));
    fixture.push("scenes", json!({"name": "0", "nodes": [1]}));
    fixture.push("scenes", json!({"nodes": [2]}));
    let load = |name: &str| {
        let options =
            crate::import::LoadOptions { scene: SceneChoice::Named(name.into()), ..Default::default() };
        fixture.try_load_with(&options).map(|(s, _)| s.nodes[0].name.clone()).map_err(|e| e.to_string())
    };
    assert_eq!(load("0").unwrap(), "b");
    assert_eq!(load("2").unwrap(), "c");
    assert_eq!(load("x").unwrap_err(), "scenes: no scene 'x'; available: '0', '0', '2'");
    fixture.json["scene"] = json!(2);
    assert_eq!(names(&fixture), ["c"]);
    fixture.json.as_object_mut().unwrap().remove("scene");
    assert_eq!(names(&fixture), ["a"]);
    fixture.json.as_object_mut().unwrap().remove("scenes");
    assert_eq!(names(&fixture), ["a", "b", "c"]);
}
