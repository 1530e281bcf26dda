//! Empty nodes that were probably area lights: Blender's exporter writes no area lights, but their nodes.

use std::collections::HashSet;

use ::gltf::json::{Index, Node};

use super::document::Document;
use super::graph::SceneNode;

/// Returns those of a scene's `nodes` in a file from Blender. The first of them has the number `offset` in the scene.
///
/// The exporter turns lights and cameras by −90° about X, so that they point along −Z; other objects without data are
/// rarely turned. A node counts only if nothing in the file says what it is for.
pub(super) fn find(doc: &Document<'_>, nodes: &[SceneNode], offset: u32) -> Vec<u32> {
    let root = doc.root();
    let mut used: HashSet<usize> = HashSet::new();
    for skin in &root.skins {
        used.extend(skin.joints.iter().chain(&skin.skeleton).map(Index::value));
    }
    let channels = root.animations.iter().flat_map(|animation| &animation.channels);
    used.extend(channels.map(|channel| channel.target.node.value()));
    let pointers = doc.json.pointers.values();
    used.extend(pointers.filter_map(|p| p.strip_prefix("/nodes/")?.split('/').next()?.parse::<usize>().ok()));
    let is_lost_light =
        |node: &SceneNode| is_turned_and_empty(&root.nodes[node.node]) && !used.contains(&node.node);
    (offset..).zip(nodes).filter(|(_, node)| is_lost_light(node)).map(|(id, _)| id).collect()
}

fn is_turned_and_empty(node: &Node) -> bool {
    let has_extensions = node
        .extensions
        .as_ref()
        .is_some_and(|extensions| extensions.khr_lights_punctual.is_some() || !extensions.others.is_empty());
    let is_turned = node.rotation.is_some_and(|rotation| rotation.0[..3].iter().any(|v| *v != 0.0));
    is_turned
        && !has_extensions
        && node.mesh.is_none()
        && node.camera.is_none()
        && node.skin.is_none()
        && node.children.as_ref().is_none_or(Vec::is_empty)
}
