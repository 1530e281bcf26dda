//! Materials of points and lines.

use std::collections::HashMap;

use blinn_scene::{Animation, Channel, ChannelTarget, Mesh, Reflectance, Scene};

/// Shows the points and lines without normals in their own colours and emission, without lighting. A material that other meshes use as
/// well is copied. Returns the copies by their originals.
pub(crate) fn show_unlit(scene: &mut Scene) -> MaterialCopies {
    let is_unlit = |mesh: &Mesh| mesh.has_rounds() && mesh.normals.is_empty();
    if !scene.meshes.iter().any(is_unlit) {
        return MaterialCopies::default();
    }
    let mut is_shared = vec![false; scene.materials.len()];
    for mesh in scene.meshes.iter().filter(|mesh| !is_unlit(mesh)) {
        is_shared[mesh.material as usize] = true;
    }
    let mut copies = HashMap::new();
    for mesh in scene.meshes.iter_mut().filter(|mesh| is_unlit(mesh)) {
        let material = mesh.material;
        if is_shared[material as usize] {
            mesh.material = *copies.entry(material).or_insert_with(|| {
                scene.materials.push(scene.materials[material as usize].clone());
                scene.materials.len() as u32 - 1
            });
        }
        let reflectance = &mut scene.materials[mesh.material as usize].reflectance;
        if *reflectance != Reflectance::Unlit {
            *reflectance = Reflectance::Unshaded;
        }
    }
    MaterialCopies(copies)
}

/// Copies of materials by their originals.
#[derive(Debug, Default)]
pub(crate) struct MaterialCopies(HashMap<u32, u32>);

impl MaterialCopies {
    /// Animates the copies like their originals.
    pub fn animate(&self, animations: &mut [Animation]) {
        if self.0.is_empty() {
            return;
        }
        for animation in animations {
            let copy = |channel: &Channel| match channel.target {
                ChannelTarget::Material(material, property) => {
                    let target = ChannelTarget::Material(*self.0.get(&material)?, property);
                    Some(Channel { target, ..channel.clone() })
                }
                _ => None,
            };
            let copies: Vec<Channel> = animation.channels.iter().filter_map(copy).collect();
            animation.channels.extend(copies);
        }
    }
}
