//! The scene graph: choice of the scene, and its nodes as a forest in which each node occurs once.

use ::gltf::json::Root;

use crate::error::{LoadError, Warnings};
use crate::files::escape::printable;
use crate::options::SceneChoice;
use blinn_core::worded;

/// A node of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct SceneNode {
    /// Index of the node in the file.
    pub node: usize,
    /// Index of the parent among the scene's nodes, which precedes this node.
    pub parent: Option<u32>,
    /// False for coarser levels of detail: what is at the node is left out.
    pub is_drawn: bool,
}

impl SceneNode {
    /// Returns the mesh that is drawn at the node.
    pub fn mesh(&self, root: &Root) -> Option<usize> {
        root.nodes.get(self.node)?.mesh.filter(|_| self.is_drawn).map(|mesh| mesh.value())
    }
}

/// Names of the file's scenes; the index stands in for a missing name.
pub(super) fn scene_names(root: &Root) -> Vec<String> {
    let name = |(i, s): (usize, &::gltf::json::Scene)| s.name.clone().unwrap_or_else(|| i.to_string());
    root.scenes.iter().enumerate().map(name).collect()
}

/// The nodes that a scene starts at.
#[derive(Debug)]
pub(super) enum Roots {
    /// The roots that the scene lists.
    Scene(Vec<usize>),
    /// All nodes of a file without scenes: those without a parent, and the others.
    File { roots: Vec<usize>, children: Vec<usize> },
}

/// Root nodes of the chosen scene. A file without scenes has all nodes without a parent.
pub(super) fn roots(root: &Root, choice: &SceneChoice, warnings: &mut Warnings) -> Result<Roots, LoadError> {
    if let Some(scene) = selected_scene(root, choice)?.and_then(|i| root.scenes.get(i)) {
        return Ok(Roots::Scene(scene.nodes.iter().map(|n| n.value()).collect()));
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
    let (children, roots) = (0..root.nodes.len()).partition(|&i| has_parent[i]);
    Ok(Roots::File { roots, children })
}

/// Index of the chosen scene; `None` if the file has none.
///
/// # Errors
/// There is no scene of the chosen name.
pub(super) fn selected_scene(root: &Root, choice: &SceneChoice) -> Result<Option<usize>, LoadError> {
    Ok(match choice {
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
    })
}

/// Warns of a default scene without meshes if another scene has some.
pub(super) fn warn_of_empty_scene(
    root: &Root,
    choice: &SceneChoice,
    nodes: &[SceneNode],
    warnings: &mut Warnings,
) {
    let has_mesh = |node: usize| root.nodes.get(node).is_some_and(|node| node.mesh.is_some());
    if *choice != SceneChoice::Default || nodes.iter().any(|node| node.mesh(root).is_some()) {
        return;
    }
    // Nodes below which there is no mesh.
    let mut is_searched = vec![false; root.nodes.len()];
    let mut shows_mesh = |scene: &::gltf::json::Scene| {
        let mut open: Vec<usize> = scene.nodes.iter().map(|node| node.value()).collect();
        while let Some(node) = open.pop() {
            let Some(flag) = is_searched.get_mut(node) else { continue };
            if has_mesh(node) {
                return true;
            }
            if !std::mem::replace(flag, true) {
                open.extend(root.nodes[node].children.iter().flatten().map(|child| child.value()));
            }
        }
        false
    };
    if let Some(other) = root.scenes.iter().position(&mut shows_mesh) {
        let default = root.scene.map_or(0, |scene| scene.value());
        let name = printable(&scene_names(root)[other]);
        let message = worded!("the default scene has no meshes; select another with `scene {}`", name);
        warnings.add(format_args!("scenes[{default}]"), message);
    }
}
