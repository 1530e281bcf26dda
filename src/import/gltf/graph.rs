//! The scene graph: choice of the scene, and its nodes once for each path from the root.

use ::gltf::json::Root;

use crate::import::error::{LoadError, Warnings};
use crate::import::files::escape::printable;
use crate::import::options::SceneChoice;

/// A node of the expanded graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ExpandedNode {
    /// Index of the node in the file.
    pub node: usize,
    /// Index of the parent among the expanded nodes, which precedes this node.
    pub parent: Option<u32>,
}

/// Names of the file's scenes; the index stands in for a missing name.
pub(super) fn scene_names(root: &Root) -> Vec<String> {
    let name = |(i, s): (usize, &::gltf::json::Scene)| s.name.clone().unwrap_or_else(|| i.to_string());
    root.scenes.iter().enumerate().map(name).collect()
}

/// Root nodes of the chosen scene. A file without scenes has all nodes without a parent.
pub(super) fn roots(
    root: &Root,
    choice: &SceneChoice,
    warnings: &mut Warnings,
) -> Result<Vec<usize>, LoadError> {
    let scene = match choice {
        SceneChoice::Named(name) => {
            let by_name = root.scenes.iter().position(|s| s.name.as_ref() == Some(name));
            let by_index = || name.parse().ok().filter(|&i: &usize| i < root.scenes.len());
            Some(by_name.or_else(by_index).ok_or_else(|| {
                let list: Vec<String> =
                    scene_names(root).iter().map(|n| format!("'{}'", printable(n))).collect();
                let list = if list.is_empty() { "none".into() } else { list.join(", ") };
                let message = format!("no scene '{}'; available: {list}", printable(name));
                LoadError::invalid("scenes", message)
            })?)
        }
        SceneChoice::Default => root.scene.map(|s| s.value()).or((!root.scenes.is_empty()).then_some(0)),
    };
    if let Some(scene) = scene.and_then(|i| root.scenes.get(i)) {
        return Ok(scene.nodes.iter().map(|n| n.value()).collect());
    }
    if !root.nodes.is_empty() {
        warnings.add("scenes", "the file has no scene; used all nodes without a parent");
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

/// Expands the graph depth first from `roots`, with children in the file's order.
///
/// Paths are counted before the expansion: forty nodes can expand to 2⁴⁰.
pub(super) fn expand(
    root: &Root,
    roots: &[usize],
    limit: u64,
    warnings: &mut Warnings,
) -> Result<Vec<ExpandedNode>, LoadError> {
    let order = parents_first(root, roots)?;
    let mut paths = vec![0u64; root.nodes.len()];
    let add = |paths: &mut Vec<u64>, node: usize, more: u64| {
        if let Some(count) = paths.get_mut(node) {
            *count = count.saturating_add(more);
        }
    };
    roots.iter().for_each(|&n| add(&mut paths, n, 1));
    for &node in &order {
        let count = paths[node];
        children(root, node).for_each(|c| add(&mut paths, c, count));
    }
    let total = paths.iter().fold(0u64, |a, &b| a.saturating_add(b));
    LoadError::check_limit("nodes, counted once per path from the root", total, limit)?;
    let shared = paths.iter().filter(|&&n| n > 1).count();
    if let Some(first) = paths.iter().position(|&n| n > 1) {
        let message =
            format!("{shared} nodes have several parents; each is drawn once per path from the root");
        warnings.add(format_args!("nodes[{first}]"), message);
    }

    let mut expanded: Vec<ExpandedNode> = Vec::with_capacity(total as usize);
    let root_node = |&node: &usize| ExpandedNode { node, parent: None };
    let mut stack: Vec<ExpandedNode> = roots.iter().rev().map(root_node).collect();
    while let Some(next) = stack.pop() {
        let parent = Some(expanded.len() as u32);
        expanded.push(next);
        stack.extend(children(root, next.node).rev().map(|node| ExpandedNode { node, parent }));
    }
    Ok(expanded)
}

/// The nodes below `roots`, each once, in topological order. A cycle is an error.
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
                    let message = format!("node {child}{name} is its own descendant; remove the cycle");
                    return Err(LoadError::invalid(format_args!("nodes[{node}].children"), message));
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
