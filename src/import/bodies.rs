//! Finds the transmissive meshes that bound bodies of glass, liquid or wax, and are not thin walls.

use std::collections::HashMap;

use glam::Vec3;

use super::GlassMode;
use blinn_scene::{Material, Mesh, Reflectance, Scene};

/// Sets [`Mesh::is_body`] of all meshes.
///
/// By default a mesh bounds a body if its material has a volume, as KHR_materials_volume specifies. Blender refracts at every
/// surface but exports no volume, and MTL's `Ni` stands for refraction: closed meshes of such files are bodies too.
pub(super) fn mark_bodies(scene: &mut Scene, mode: GlassMode) {
    let may_bound = |material: &Material| material.transmits() || material.diffuses_inside();
    if mode == GlassMode::Thin || !scene.materials.iter().any(may_bound) {
        return;
    }
    let mut closed = ClosedObjects::new(scene);
    let mut is_body = vec![false; scene.meshes.len()];
    for instance in &scene.instances {
        let is_body = &mut is_body[instance.mesh as usize];
        let material = &scene.materials[scene.meshes[instance.mesh as usize].material as usize];
        *is_body |= material.diffuses_inside();
        *is_body |= material.transmits()
            && (mode == GlassMode::Solid
                || material.volume.is_some()
                || refracts_if_closed(scene, material) && closed.is_closed(scene, instance.object));
    }
    for (mesh, is_body) in scene.meshes.iter_mut().zip(is_body) {
        mesh.is_body = is_body;
    }
}

/// True if closed meshes of a transmissive material are bodies, though it has no volume: in Blender's files, and in MTL files
/// that give an index of refraction.
pub fn refracts_if_closed(scene: &Scene, material: &Material) -> bool {
    match &material.reflectance {
        Reflectance::Mtl(mtl) => mtl.ior > 1.0,
        _ => scene.source.is_blender(),
    }
}

/// A cache of the objects that are closed.
struct ClosedObjects {
    /// The meshes of each object. Objects that are instances of the same meshes have the same answer.
    meshes: HashMap<u32, Vec<u32>>,
    known: HashMap<Vec<u32>, bool>,
}

impl ClosedObjects {
    fn new(scene: &Scene) -> ClosedObjects {
        let mut meshes: HashMap<u32, Vec<u32>> = HashMap::new();
        for instance in &scene.instances {
            meshes.entry(instance.object).or_default().push(instance.mesh);
        }
        // A primitive is in an object once, also if the object is instanced by a list of transforms.
        for of_object in meshes.values_mut() {
            of_object.sort_unstable();
            of_object.dedup();
        }
        ClosedObjects { meshes, known: HashMap::new() }
    }

    fn is_closed(&mut self, scene: &Scene, object: u32) -> bool {
        let Some(ids) = self.meshes.get(&object) else { return false };
        if let Some(&known) = self.known.get(ids) {
            return known;
        }
        let closed = is_closed(ids.iter().map(|&id| &scene.meshes[id as usize]));
        self.known.insert(ids.clone(), closed);
        closed
    }
}

/// True if every edge of the meshes together is passed as often in one direction as in the other: they enclose a volume.
/// Vertices at the same position are one.
fn is_closed<'m>(meshes: impl Iterator<Item = &'m Mesh>) -> bool {
    let mut vertices: HashMap<[u32; 3], u32> = HashMap::new();
    let mut balance: HashMap<[u32; 2], i64> = HashMap::new();
    let mut has_triangles = false;
    for mesh in meshes {
        for triangle in &mesh.triangles {
            let corners = triangle.map(|i| {
                let next = vertices.len() as u32;
                *vertices.entry(bits(mesh.positions[i as usize])).or_insert(next)
            });
            for [a, b] in [[0, 1], [1, 2], [2, 0]].map(|edge| edge.map(|i| corners[i])) {
                if a != b {
                    *balance.entry([a.min(b), a.max(b)]).or_default() += if a < b { 1 } else { -1 };
                }
            }
            has_triangles = true;
        }
    }
    has_triangles && balance.values().all(|&sum| sum == 0)
}

/// A position as a key: −0 is 0.
fn bits(p: Vec3) -> [u32; 3] {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron, with vertices of its own for each triangle.
    fn tetrahedron() -> Mesh {
        let p = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        Mesh {
            positions: faces.iter().flatten().map(|&i: &usize| p[i]).collect(),
            triangles: (0..4).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..Default::default()
        }
    }

    #[test]
    fn a_tetrahedron_is_closed_until_a_face_is_missing_or_turned() {
        let whole = tetrahedron();
        assert!(is_closed([&whole].into_iter()));
        let mut open = whole.clone();
        open.triangles.pop();
        assert!(!is_closed([&open].into_iter()));
        let mut turned = whole.clone();
        turned.triangles[0].swap(1, 2);
        assert!(!is_closed([&turned].into_iter()));
        assert!(!is_closed([&Mesh::default()].into_iter()));
    }

    #[test]
    fn the_primitives_of_an_object_close_together() {
        let whole = tetrahedron();
        let part = |range: std::ops::Range<usize>| Mesh {
            triangles: whole.triangles[range].to_vec(),
            ..whole.clone()
        };
        let parts = [part(0..1), part(1..4)];
        assert!(!is_closed(parts[1..].iter()));
        assert!(is_closed(parts.iter()));
    }
}
