//! The scene graph: which scene, and its nodes once for each path that leads to them.

use ::gltf::json::Root;

use crate::import::SceneChoice;
use crate::import::error::{LoadError, Warnings};
use crate::import::files::escape::printable;

/// A node of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Placed {
    /// Index of the file's node.
    pub node: usize,
    /// Its parent's position in the walk, before its own.
    pub parent: Option<u32>,
}

/// Names of the file's scenes; those without one go by their index.
pub(super) fn scene_names(root: &Root) -> Vec<String> {
    let name = |(i, s): (usize, &::gltf::json::Scene)| s.name.clone().unwrap_or_else(|| i.to_string());
    root.scenes.iter().enumerate().map(name).collect()
}

/// The roots of the scene that was asked for.
pub(super) fn roots(
    root: &Root,
    choice: &SceneChoice,
    warnings: &mut Warnings,
) -> Result<Vec<usize>, LoadError> {
    let scene = match choice {
        SceneChoice::Named(wanted) => {
            let named = root.scenes.iter().position(|s| s.name.as_ref() == Some(wanted));
            let numbered = || wanted.parse().ok().filter(|&i: &usize| i < root.scenes.len());
            Some(named.or_else(numbered).ok_or_else(|| {
                let list: Vec<String> =
                    scene_names(root).iter().map(|n| format!("'{}'", printable(n))).collect();
                let list = if list.is_empty() { "none".into() } else { list.join(", ") };
                let rule = format!("there is no scene '{}'; the file has: {list}", printable(wanted));
                LoadError::invalid("scenes", rule)
            })?)
        }
        SceneChoice::Default => root.scene.map(|s| s.value()).or((!root.scenes.is_empty()).then_some(0)),
    };
    if let Some(scene) = scene.and_then(|i| root.scenes.get(i)) {
        return Ok(scene.nodes.iter().map(|n| n.value()).collect());
    }
    if !root.nodes.is_empty() {
        warnings.add("scenes", "the file has no scene; every node without a parent is drawn");
    }
    let mut has_parent = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
        if let Some(flag) = has_parent.get_mut(child.value()) {
            *flag = true;
        }
    }
    Ok((0..root.nodes.len()).filter(|&i| !has_parent[i]).collect())
}

fn children(root: &Root, node: usize) -> impl DoubleEndedIterator<Item = usize> + ExactSizeIterator + '_ {
    let list = root.nodes.get(node).and_then(|n| n.children.as_deref()).unwrap_or_default();
    list.iter().map(|c| c.value())
}

/// Walks the graph depth first from `roots`, children in the file's order.
///
/// Paths are counted before any is walked: forty nodes can stand for 2⁴⁰.
pub(super) fn expand(
    root: &Root,
    roots: &[usize],
    limit: u64,
    warnings: &mut Warnings,
) -> Result<Vec<Placed>, LoadError> {
    let order = parents_first(root, roots)?;
    let mut paths = vec![0u64; root.nodes.len()];
    let reach = |paths: &mut Vec<u64>, node: usize, more: u64| {
        if let Some(count) = paths.get_mut(node) {
            *count = count.saturating_add(more);
        }
    };
    roots.iter().for_each(|&n| reach(&mut paths, n, 1));
    for &node in &order {
        let count = paths[node];
        children(root, node).for_each(|c| reach(&mut paths, c, count));
    }
    let total = paths.iter().fold(0u64, |a, &b| a.saturating_add(b));
    LoadError::check_limit("nodes, shared ones repeated,", total, limit)?;
    let shared = paths.iter().filter(|&&n| n > 1).count();
    if let Some(first) = paths.iter().position(|&n| n > 1) {
        let what = format!("{shared} nodes hang in several places, and are drawn once for each");
        warnings.add(format_args!("nodes[{first}]"), what);
    }

    let mut placed: Vec<Placed> = Vec::with_capacity(total as usize);
    let mut stack: Vec<Placed> = roots.iter().rev().map(|&node| Placed { node, parent: None }).collect();
    while let Some(next) = stack.pop() {
        let parent = Some(placed.len() as u32);
        placed.push(next);
        stack.extend(children(root, next.node).rev().map(|node| Placed { node, parent }));
    }
    Ok(placed)
}

/// The nodes below `roots`, each once, parents before children. A cycle is an error.
fn parents_first(root: &Root, roots: &[usize]) -> Result<Vec<usize>, LoadError> {
    #[derive(Clone, Copy, PartialEq)]
    enum State {
        New,
        Open,
        Done,
    }
    let mut state = vec![State::New; root.nodes.len()];
    let mut order = Vec::new();
    let mut stack: Vec<(usize, usize)> = Vec::new();
    for &start in roots {
        if state.get(start) != Some(&State::New) {
            continue;
        }
        state[start] = State::Open;
        stack.push((start, 0));
        while let Some((node, next)) = stack.last_mut() {
            let Some(child) = children(root, *node).nth(*next) else {
                state[*node] = State::Done;
                order.push(*node);
                stack.pop();
                continue;
            };
            *next += 1;
            match state.get(child) {
                Some(State::Open) => {
                    let name = root.nodes[child].name.as_deref().unwrap_or_default();
                    let name =
                        if name.is_empty() { String::new() } else { format!(" ('{}')", printable(name)) };
                    let rule = format!("node {child}{name} is its own descendant; break the cycle");
                    return Err(LoadError::invalid(format_args!("nodes[{node}].children"), rule));
                }
                Some(State::New) => {
                    state[child] = State::Open;
                    stack.push((child, 0));
                }
                _ => {}
            }
        }
    }
    order.reverse();
    Ok(order)
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::super::fixture::Fixture;
    use super::*;

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
    fn depth_first_in_file_order() {
        let nodes = json!([{"name": "a", "children": [3, 2]}, {"name": "b"}, {"name": "c"}, {"name": "d", "children": [4]}, {"name": "e"}]);
        assert_eq!(names(&graph(nodes, json!([1, 0]))), ["b", "a", "d", "e", "c"]);
    }

    #[test]
    fn a_cycle_is_named() {
        let nodes = json!([{"children": [1]}, {"name": "loop", "children": [2]}, {"children": [1]}]);
        let error = graph(nodes, json!([0])).error();
        assert_eq!(error, "nodes[2].children: node 1 ('loop') is its own descendant; break the cycle");
        assert!(graph(json!([{"children": [0]}]), json!([0])).error().contains("own descendant"));
    }

    #[test]
    fn shared_nodes_are_repeated_and_counted_before() {
        let diamond = json!([{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {"name": "shared"}]);
        let (scene, warnings) = graph(diamond, json!([0])).load();
        assert_eq!(scene.nodes.iter().filter(|n| n.name == "shared").count(), 2);
        assert!(warnings[0].starts_with("nodes[3]: 1 nodes hang in several places"), "{warnings:?}");
        let doubling = |n: usize| (0..n).map(|i| json!({"children": [i + 1, i + 1]})).chain([json!({})]);
        for levels in [40, 80] {
            let error = graph(doubling(levels).collect(), json!([0])).error();
            assert!(error.contains("exceeds the limit"), "{error}");
        }
    }

    #[test]
    fn chains_may_be_deep() {
        let nodes: Vec<Value> = (1..100_000)
            .map(|i| json!({"children": [i], "translation": [1, 0, 0]}))
            .chain([json!({})])
            .collect();
        let (scene, _) = graph(json!(nodes), json!([0])).load();
        assert_eq!(scene.nodes.len(), 100_000);
    }

    #[test]
    fn scenes_by_name_then_index() {
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
        assert_eq!(load("x").unwrap_err(), "scenes: there is no scene 'x'; the file has: '0', '0', '2'");
        fixture.json["scene"] = json!(2);
        assert_eq!(names(&fixture), ["c"]);
        fixture.json.as_object_mut().unwrap().remove("scene");
        assert_eq!(names(&fixture), ["a"]);
        fixture.json.as_object_mut().unwrap().remove("scenes");
        assert_eq!(names(&fixture), ["a", "b", "c"]);
    }
}
