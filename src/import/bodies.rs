//! Finds the transmissive meshes that bound bodies of glass, liquid or wax, and are not thin walls.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::GlassMode;
use blinn_scene::{Material, Mesh, Reflectance, Scene};

/// Sets [`Mesh::is_body`] of all meshes.
///
/// By default a mesh bounds a body if its material has a volume, as KHR_materials_volume specifies. Blender refracts at every
/// surface but exports no volume, and MTL's `Ni` stands for refraction: closed meshes of such files are bodies too, and so are
/// open ones of Blender unless they are flat, like a window pane.
pub(super) fn mark_bodies(scene: &mut Scene, mode: GlassMode) {
    let may_bound = |material: &Material| material.transmits() || material.diffuses_inside();
    if mode == GlassMode::Thin || !scene.materials.iter().any(may_bound) {
        return;
    }
    let mut bounding = BoundingObjects::new(scene);
    let mut is_body = vec![false; scene.meshes.len()];
    for instance in &scene.instances {
        let is_body = &mut is_body[instance.mesh as usize];
        let material = &scene.materials[scene.meshes[instance.mesh as usize].material as usize];
        *is_body |= material.diffuses_inside();
        *is_body |= material.transmits()
            && (mode == GlassMode::Solid
                || material.volume.is_some()
                || refracts_if_closed(scene, material) && bounding.may_bound(scene, instance.object));
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
        _ => scene.source.is_blender() && !material.thin_wall,
    }
}

/// A cache of the objects that may bound a body.
struct BoundingObjects {
    /// The meshes of each object. Objects that are instances of the same meshes have the same answer.
    meshes: HashMap<u32, Vec<u32>>,
    known: HashMap<Vec<u32>, bool>,
}

impl BoundingObjects {
    fn new(scene: &Scene) -> BoundingObjects {
        let mut meshes: HashMap<u32, Vec<u32>> = HashMap::new();
        for instance in &scene.instances {
            meshes.entry(instance.object).or_default().push(instance.mesh);
        }
        // A primitive is in an object once, also if the object is instanced by a list of transforms.
        for of_object in meshes.values_mut() {
            of_object.sort_unstable();
            of_object.dedup();
        }
        BoundingObjects { meshes, known: HashMap::new() }
    }

    /// True if an object is closed, or one of Blender's that is not flat.
    fn may_bound(&mut self, scene: &Scene, object: u32) -> bool {
        let Some(ids) = self.meshes.get(&object) else { return false };
        if let Some(&known) = self.known.get(ids) {
            return known;
        }
        let meshes = || ids.iter().map(|&id| &scene.meshes[id as usize]);
        let bounds = scene.source.is_blender() && !is_flat(meshes()) || is_closed(meshes());
        self.known.insert(ids.clone(), bounds);
        bounds
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

/// True if all triangles of the meshes are in one plane, within 1 % of their extent.
fn is_flat<'m>(meshes: impl Iterator<Item = &'m Mesh> + Clone) -> bool {
    let corners = |mesh: &'m Mesh| mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize]);
    let positions = || meshes.clone().flat_map(corners).map(Vec3::as_dvec3);
    let Some(origin) = positions().next() else { return true };
    let triangles = meshes
        .clone()
        .flat_map(|mesh| mesh.triangles.iter().map(|t| t.map(|i| mesh.positions[i as usize].as_dvec3())));
    let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
    let largest = triangles.map(area).max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let normal = largest.map_or(DVec3::ZERO, DVec3::normalize_or_zero);
    let extent = positions().map(|p| p.distance(origin)).fold(0.0, f64::max);
    positions().all(|p| (p - origin).dot(normal).abs() <= 0.01 * extent)
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
    fn open_glass_of_blender_is_a_body_unless_it_is_flat() {
        let mut open = tetrahedron();
        open.triangles.pop();
        let flat = Mesh { triangles: vec![open.triangles[0]], ..open.clone() };
        assert!(is_flat([&flat].into_iter()) && !is_flat([&open].into_iter()));
        let is_body = |mesh: &Mesh, generator: &str| {
            let mut material = Material::default();
            material.transmission.factor = 1.0;
            let mut scene =
                Scene { materials: vec![material], meshes: vec![mesh.clone()], ..Default::default() };
            scene.source.generator = generator.into();
            scene.instances.push(Default::default());
            mark_bodies(&mut scene, GlassMode::Auto);
            scene.meshes[0].is_body
        };
        let blender = "Khronos glTF Blender I/O v5.0.21";
        assert!(is_body(&open, blender) && !is_body(&flat, blender));
        assert!(!is_body(&open, "another exporter") && !is_body(&tetrahedron(), "another exporter"));
    }

    #[test]
    fn thin_walls_of_blender_are_bodies_on_request_alone() {
        let is_body = |thin_wall: bool, mode: GlassMode| {
            let mut material = Material { thin_wall, ..Material::default() };
            material.transmission.factor = 1.0;
            let mut scene =
                Scene { materials: vec![material], meshes: vec![tetrahedron()], ..Default::default() };
            scene.source.generator = "Khronos glTF Blender I/O v5.2.41".into();
            scene.instances.push(Default::default());
            mark_bodies(&mut scene, mode);
            scene.meshes[0].is_body
        };
        assert!(is_body(false, GlassMode::Auto) && !is_body(true, GlassMode::Auto));
        assert!(is_body(true, GlassMode::Solid));
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
