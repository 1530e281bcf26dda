//! The scene graph: order, graphs that are not trees, and the choice of the scene.

use serde_json::{Value, json};

use super::super::fixture::Fixture;
use crate::SceneChoice;
use blinn_scene::ChannelTarget;

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

/// The nodes' names with their parents, and the warnings.
fn tree(nodes: Value, roots: Value) -> (Vec<(String, Option<u32>)>, Vec<String>) {
    let (scene, warnings) = graph(nodes, roots).load();
    (scene.nodes.iter().map(|n| (n.name.clone(), n.parent)).collect(), warnings)
}

fn assert_tree(nodes: Value, roots: Value, expected: &[(&str, Option<u32>)], warning: &str) {
    let (tree, warnings) = tree(nodes, roots);
    let tree: Vec<(&str, Option<u32>)> = tree.iter().map(|(name, parent)| (&**name, *parent)).collect();
    assert_eq!((&tree[..], &warnings[..]), (expected, &[warning.to_string()][..]));
}

#[test]
fn a_root_that_is_also_a_child_is_below_its_parent() {
    let warning = "nodes[1]: 1 nodes are both roots and children; each is drawn once, below its parent";
    let nodes = json!([{"name": "a", "children": [1]}, {"name": "b", "children": [2]}, {"name": "c"}]);
    let expected = [("a", None), ("b", Some(0)), ("c", Some(1))];
    // Before and after its parent, and with a root between them.
    assert_tree(nodes.clone(), json!([0, 1]), &expected, warning);
    assert_tree(nodes.clone(), json!([1, 0]), &expected, warning);
    let all = warning.replace("1 nodes", "2 nodes");
    assert_tree(nodes.clone(), json!([2, 1, 0]), &expected, &all);
    // A child whose parent is not in the scene is a root.
    assert_eq!(tree(nodes, json!([1])), (vec![("b".into(), None), ("c".into(), Some(0))], vec![]));
}

#[test]
fn a_node_with_several_parents_is_below_the_first() {
    let warning = "nodes[3]: 1 nodes have several parents; each is drawn once, below the first";
    let nodes = json!([{"name": "a", "children": [2, 1]}, {"name": "b", "children": [3]},
        {"name": "c", "children": [3]}, {"name": "d"}]);
    let expected = [("a", None), ("c", Some(0)), ("d", Some(1)), ("b", Some(0))];
    assert_tree(nodes.clone(), json!([0]), &expected, warning);
    // A parent outside of the scene does not count.
    let (found, warnings) = tree(nodes, json!([1]));
    assert_eq!((found, warnings), (vec![("b".into(), None), ("d".into(), Some(0))], vec![]));
}

#[test]
fn nodes_that_are_listed_twice_are_drawn_once() {
    let warning = "nodes[0]: 1 nodes are listed more than once; each is drawn once";
    let nodes = json!([{"name": "a"}, {"name": "b"}]);
    assert_tree(nodes, json!([0, 1, 0]), &[("a", None), ("b", None)], warning);
    let nodes = json!([{"name": "a"}, {"name": "b", "children": [0, 0]}]);
    assert_tree(nodes, json!([1]), &[("b", None), ("a", Some(0))], warning);
}

#[test]
fn cycles_are_cut_at_the_reference_to_the_ancestor() {
    let warning = "nodes[2].children: 1 nodes have an ancestor as a child; ignored that child";
    let nodes = json!([{"name": "a", "children": [1]}, {"name": "b", "children": [2]},
        {"name": "c", "children": [1]}]);
    let expected = [("a", None), ("b", Some(0)), ("c", Some(1))];
    assert_tree(nodes, json!([0]), &expected, warning);
    let (own, warnings) = tree(json!([{"name": "a", "children": [0]}]), json!([0]));
    assert_eq!((own.len(), warnings.len()), (1, 1), "{warnings:?}");
    // Each of two roots is the other's child.
    let nodes = json!([{"name": "a", "children": [1]}, {"name": "b", "children": [0]}]);
    let (tree, warnings) = tree(nodes, json!([1, 0]));
    assert_eq!(tree, [("b".into(), None), ("a".into(), Some(0))]);
    assert_eq!(warnings.len(), 2, "{warnings:?}");
}

#[test]
fn cycles_of_a_file_without_a_scene_are_drawn() {
    let mut fixture = graph(
        json!([{"name": "a", "children": [2]}, {"name": "b"}, {"name": "c", "children": [3]},
            {"name": "d", "children": [2, 1]}, {"name": "e", "children": [5]}, {"name": "f", "children": [4]}]),
        json!([]),
    );
    fixture.json.as_object_mut().unwrap().remove("scenes");
    fixture.json.as_object_mut().unwrap().remove("scene");
    assert_eq!(names(&fixture), ["a", "c", "d", "b", "e", "f"]);
    assert_eq!(fixture.load().1.len(), 2, "{:?}", fixture.load().1);
}

/// Forty nodes that list their successor twice have 2^40 paths, and references to ancestors take no walk.
#[test]
fn graphs_with_many_paths_are_loaded_in_linear_time() {
    let doubling = |n: usize| (0..n).map(|i| json!({"children": [i + 1, i + 1]})).chain([json!({})]);
    for levels in [40, 80] {
        assert_eq!(names(&graph(doubling(levels).collect(), json!([0]))).len(), levels + 1);
    }
    let back = |i: usize| json!({"children": [i + 1, i / 2, 0]});
    let nodes: Vec<Value> = (0..50_000).map(back).chain([json!({})]).collect();
    assert_eq!(names(&graph(json!(nodes), json!([0]))).len(), 50_001);
}

#[test]
fn joints_and_animated_nodes_that_are_listed_twice_move_once() {
    let mut fixture = super::animation::skinned();
    // The joints 1 and 2 are roots; 2 is also a child of 1 and of the mesh's node.
    fixture.json["nodes"][1]["children"] = json!([2]);
    fixture.json["nodes"][0]["children"] = json!([2]);
    let times = fixture.floats("SCALAR", 1, &[0.0, 1.0]);
    let values = fixture.vec3(&[[0.0; 3], [0.0, 0.0, 4.0]]);
    fixture.push(
        "animations",
        json!({"samplers": [{"input": times, "output": values}],
        "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}]}),
    );
    let (scene, warnings) = fixture.load();
    let joints: Vec<&str> =
        scene.skins[0].joints.iter().map(|&j| scene.nodes[j as usize].name.as_str()).collect();
    assert_eq!((scene.nodes.len(), joints.len(), scene.animations[0].channels.len()), (3, 2, 1));
    assert_eq!(scene.animations[0].channels[0].target, ChannelTarget::Translation(scene.skins[0].joints[1]));
    assert_eq!(warnings.len(), 2, "{warnings:?}");
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
        let options = crate::LoadOptions { scene: SceneChoice::Named(name.into()), ..Default::default() };
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

#[test]
fn an_empty_default_scene_beside_a_full_one_names_the_flag() {
    let mut fixture = Fixture::triangle();
    fixture.push("nodes", json!({"children": [0]}));
    fixture.push("scenes", json!({"name": "full", "nodes": [1]}));
    fixture.json["scenes"][0]["nodes"] = json!([]);
    let (scene, warnings) = fixture.load();
    assert!(scene.instances.is_empty());
    let warning = "scenes[0]: the default scene has no meshes; select another with `scene full`";
    assert_eq!(warnings, [warning]);
    // No other scene has meshes, or the user has selected the empty one.
    let options = crate::LoadOptions { scene: SceneChoice::Named("0".into()), ..Default::default() };
    assert!(fixture.load_with(&options).1.is_empty());
    fixture.json["scenes"][1]["nodes"] = json!([]);
    assert!(fixture.load().1.is_empty());
}

/// Loads nodes with a mesh at those named in capitals. Returns the names of the nodes that show it.
fn drawn(mut nodes: Value, roots: Value) -> Vec<String> {
    let mut fixture = Fixture::triangle();
    for node in nodes.as_array_mut().unwrap() {
        if node["name"].as_str().unwrap().starts_with(char::is_uppercase) {
            node["mesh"] = json!(0);
        }
    }
    fixture.json["nodes"] = nodes;
    fixture.json["scenes"][0]["nodes"] = roots;
    let (scene, _) = fixture.load();
    scene.instances.iter().map(|i| scene.nodes[i.node as usize].name.clone()).collect()
}

fn lod(ids: &[u64]) -> Value {
    json!({"MSFT_lod": {"ids": ids}})
}

#[test]
fn coarser_levels_of_detail_in_the_scene_are_not_drawn() {
    // Siblings, with what is below them; and children of the level with the extension.
    let nodes = json!([{"name": "A", "extensions": lod(&[1, 2])}, {"name": "B"},
        {"name": "c", "children": [3]}, {"name": "D"}, {"name": "E"}]);
    assert_eq!(drawn(nodes, json!([2, 0, 1, 4])), ["A", "E"]);
    let nodes = json!([{"name": "a", "children": [1, 2, 3], "extensions": lod(&[2, 3])}, {"name": "B"},
        {"name": "C"}, {"name": "D"}]);
    assert_eq!(drawn(nodes, json!([0])), ["B"]);
    // A chain, in which each level names the next one.
    for roots in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
        let nodes = json!([{"name": "A", "extensions": lod(&[1])}, {"name": "B", "extensions": lod(&[2])}, {"name": "C"}]);
        assert_eq!(drawn(nodes, json!(roots)), ["A"], "{roots:?}");
    }
    // A node without a mesh only lists its levels.
    let nodes = json!([{"name": "a", "children": [1, 2, 3], "extensions": lod(&[1, 2, 3])}, {"name": "b"},
        {"name": "C"}, {"name": "D"}]);
    assert_eq!(drawn(nodes, json!([0])), ["C"]);
}

#[test]
fn malformed_levels_of_detail_hide_nothing_else() {
    let nodes = json!([{"name": "A", "children": [1], "extensions": lod(&[0, 9, u64::MAX])},
        {"name": "B", "extensions": lod(&[0, 1])}, {"name": "C", "extensions": {"MSFT_lod": {"ids": "x"}}}]);
    assert_eq!(drawn(nodes, json!([0, 2])), ["A", "B", "C"]);
    // Two nodes that name each other.
    let nodes = json!([{"name": "A", "extensions": lod(&[1, 1])}, {"name": "B", "extensions": lod(&[0])}]);
    assert_eq!(drawn(nodes, json!([0, 1])), ["A"]);
    // A level that names the group of the finest one.
    let nodes = json!([{"name": "a", "children": [1]}, {"name": "B", "extensions": lod(&[2])},
        {"name": "C", "extensions": lod(&[0])}]);
    assert_eq!(drawn(nodes, json!([0, 2])), ["B"]);
    // A level of a node outside the scene.
    let nodes = json!([{"name": "A", "extensions": lod(&[1])}, {"name": "B"}]);
    assert_eq!(drawn(nodes, json!([1])), ["B"]);
}
