//! Materials of points and lines.

use std::collections::HashMap;

use blinn_scene::{Mesh, Reflectance, Scene};

/// Shows the points and lines without normals in their own colours, without lighting. A material that other meshes use as
/// well is copied.
pub(crate) fn show_unlit(scene: &mut Scene) {
    let is_unlit = |mesh: &Mesh| mesh.has_rounds() && mesh.normals.is_empty();
    if !scene.meshes.iter().any(is_unlit) {
        return;
    }
    let mut is_shared = vec![false; scene.materials.len()];
    for mesh in scene.meshes.iter().filter(|mesh| !is_unlit(mesh)) {
        is_shared[mesh.material as usize] = true;
    }
    let mut copies: HashMap<u32, u32> = HashMap::new();
    for mesh in scene.meshes.iter_mut().filter(|mesh| is_unlit(mesh)) {
        let material = mesh.material;
        if is_shared[material as usize] {
            mesh.material = *copies.entry(material).or_insert_with(|| {
                scene.materials.push(scene.materials[material as usize].clone());
                scene.materials.len() as u32 - 1
            });
        }
        scene.materials[mesh.material as usize].reflectance = Reflectance::Unlit;
    }
}
