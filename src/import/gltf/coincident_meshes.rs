//! Meshes that a file of Blender draws twice at one place.

use std::collections::HashSet;

use glam::DAffine3;

use crate::error::Warnings;
use crate::files::escape::printable;
use blinn_scene::{Instance, Node, Scene};

/// Warns of meshes that lie on equal ones: the exporter writes collections in instanced collections more than once.
pub(super) fn warn(scene: &Scene, warnings: &mut Warnings) {
    // Copies that lie on each other at rest may move apart.
    if !scene.animations.is_empty() {
        return;
    }
    let transforms = world_transforms(&scene.nodes);
    let is_plain = |instance: &&Instance| {
        let node = &scene.nodes[instance.node as usize];
        node.visible && node.weights.is_empty() && instance.skin.is_none() && instance.trs.is_none()
    };
    let mut known = HashSet::new();
    let mut copies: Vec<u32> = Vec::new();
    for instance in scene.instances.iter().filter(is_plain) {
        let transform = transforms[instance.node as usize].to_cols_array();
        // Other parents give other last bits. Adding 0 makes −0 equal to 0.
        let place = transform.map(|value| (value as f32 + 0.0).to_bits());
        // The primitives of an object follow each other.
        if !known.insert((instance.mesh, place)) && copies.last() != Some(&instance.object) {
            copies.push(instance.object);
        }
    }
    let Some(&first) = copies.first() else { return };
    let name = (first as usize).checked_sub(1).and_then(|i| scene.objects.get(i)).map_or("", String::as_str);
    let name = printable(name);
    let what = match copies.len() {
        1 => format!("mesh '{name}' lies on an equal one"),
        count => format!("{count} meshes lie on equal ones, such as '{name}'"),
    };
    warnings.add(
        "",
        format_args!(
            "{what}: Blender writes collections in instanced collections more than once, which shows where they are \
             transparent; export with Include › Limit to › Visible Objects"
        ),
    );
}

/// The transform of each node to the world in the rest pose. Parents come before their children.
pub(super) fn world_transforms(nodes: &[Node]) -> Vec<DAffine3> {
    let mut transforms: Vec<DAffine3> = Vec::with_capacity(nodes.len());
    for node in nodes {
        let parent = node.parent.map_or(DAffine3::IDENTITY, |parent| transforms[parent as usize]);
        transforms.push(parent * node.local.affine());
    }
    transforms
}
