//! Triangles in an order that follows from their places and not from the file.
//!
//! A ray through a shared edge hits both triangles at the same distance, and the first one of the file counts. Rounding
//! also depends on the corner that comes first. Pictures of the same triangles are equal if their order is.

use glam::Vec3;
use rayon::prelude::*;

use blinn_core::geometry::HitId;
use blinn_scene::{Polygons, PosedScene, Scene};

/// The order of the triangles of each mesh, and of their corners.
pub struct CanonicalOrder {
    /// `None` for meshes that keep the order of the file.
    meshes: Vec<Option<MeshOrder>>,
}

struct MeshOrder {
    triangles: Vec<[u32; 3]>,
    polygons: Polygons,
}

/// A triangle whose first corner is the lowest one, ordered by the bits of its coordinates.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct KeyedTriangle {
    place: [[u32; 3]; 3],
    corners: [u32; 3],
}

impl CanonicalOrder {
    /// Finds the order of a scene's triangles by their places in world space, relative to the centre. Meshes that mark
    /// edges triangle by triangle keep their order, and so do points and lines.
    pub fn new(posed: &PosedScene) -> CanonicalOrder {
        let mut instances = vec![None; posed.scene.meshes.len()];
        for (i, instance) in posed.scene.instances.iter().enumerate() {
            instances[instance.mesh as usize].get_or_insert(i as u32);
        }
        let meshes = instances.into_iter().map(|instance| mesh_order(posed, instance?)).collect();
        CanonicalOrder { meshes }
    }

    /// Orders the triangles of the scene that was posed.
    pub fn apply(self, scene: &mut Scene) {
        for (mesh, order) in scene.meshes.iter_mut().zip(self.meshes) {
            if let Some(MeshOrder { triangles, polygons }) = order {
                mesh.triangles = triangles;
                mesh.polygons = polygons;
            }
        }
    }
}

/// The order of the triangles of an instance's mesh.
fn mesh_order(posed: &PosedScene, instance: u32) -> Option<MeshOrder> {
    let mesh = posed.mesh(instance);
    if !mesh.edge_marks.is_empty() || mesh.triangles.is_empty() {
        return None;
    }
    let keyed = mesh.triangles.iter().enumerate().map(|(i, &corners)| {
        KeyedTriangle::new(posed.world_triangle(HitId { instance, triangle: i as u32 }), corners)
    });
    let mut polygons = Polygons::default();
    if mesh.polygons.is_empty() {
        let mut keyed: Vec<KeyedTriangle> = keyed.collect();
        keyed.par_sort_unstable();
        let triangles = keyed.into_iter().map(|triangle| triangle.corners).collect();
        return Some(MeshOrder { triangles, polygons });
    }
    // The triangles of a polygon stay together.
    let mut groups: Vec<Vec<KeyedTriangle>> = Vec::new();
    for (i, triangle) in keyed.enumerate() {
        match groups.last_mut() {
            Some(group) if mesh.polygons.is_joined(i) => group.push(triangle),
            _ => groups.push(vec![triangle]),
        }
    }
    groups.par_iter_mut().for_each(|group| group.sort_unstable());
    groups.par_sort_unstable();
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    for group in groups {
        for (i, triangle) in group.into_iter().enumerate() {
            if i > 0 {
                polygons.join(triangles.len());
            }
            triangles.push(triangle.corners);
        }
    }
    Some(MeshOrder { triangles, polygons })
}

impl KeyedTriangle {
    fn new(places: [Vec3; 3], corners: [u32; 3]) -> KeyedTriangle {
        // -0 is 0.
        let bits = places.map(|place| (place + 0.0).to_array().map(f32::to_bits));
        let turned = |start: usize| [0, 1, 2].map(|i| bits[(start + i) % 3]);
        let start = (0..3).min_by_key(|start| turned(*start)).unwrap_or(0);
        KeyedTriangle { place: turned(start), corners: [0, 1, 2].map(|i| corners[(start + i) % 3]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_scene::{Instance, Material, Mesh, Node, PoseSettings, pose};

    /// A row of squares in a mesh, of two triangles each.
    fn scene(triangles: Vec<[u32; 3]>, joined: &[usize]) -> Scene {
        let positions = (0..12u8).map(|i| Vec3::new(f32::from(i / 2), f32::from(i % 2), 0.0)).collect();
        let mut mesh = Mesh { positions, triangles, ..Mesh::default() };
        joined.iter().for_each(|triangle| mesh.polygons.join(*triangle));
        Scene {
            nodes: vec![Node { visible: true, ..Node::default() }],
            meshes: vec![mesh],
            instances: vec![Instance::default()],
            materials: vec![Material::default()],
            ..Scene::default()
        }
    }

    fn ordered(mut scene: Scene) -> (Vec<[u32; 3]>, Polygons) {
        let order = CanonicalOrder::new(&pose(&scene, &PoseSettings::default()).unwrap());
        order.apply(&mut scene);
        let mesh = scene.meshes.remove(0);
        (mesh.triangles, mesh.polygons)
    }

    #[test]
    fn triangles_and_corners_have_one_order() {
        let triangles: Vec<[u32; 3]> =
            (0..5u32).flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]]).collect();
        let mut shuffled: Vec<[u32; 3]> = (0..10).map(|i| triangles[i * 7 % 10]).collect();
        shuffled.iter_mut().step_by(2).for_each(|corners| corners.rotate_left(1));
        let expected = ordered(scene(triangles.clone(), &[]));
        assert_eq!(ordered(scene(shuffled, &[])), expected);
        let mut all = expected.0.clone();
        all.iter_mut().for_each(|corners| {
            let first = (0..3).min_by_key(|i| corners[*i]).unwrap_or(0);
            corners.rotate_left(first);
        });
        all.sort_unstable();
        let mut sorted = triangles;
        sorted.sort_unstable();
        assert_eq!(all, sorted);
    }

    #[test]
    fn polygons_stay_together() {
        let quad = |i: u32| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]];
        let (a, b) = ([quad(3), quad(0), quad(2)].concat(), [quad(0), quad(2), quad(3)].concat());
        let (triangles, polygons) = ordered(scene(a, &[1, 3, 5]));
        assert_eq!((triangles.clone(), polygons.clone()), ordered(scene(b, &[1, 3, 5])));
        let is_joined: Vec<bool> = (0..6).map(|i| polygons.is_joined(i)).collect();
        assert_eq!(is_joined, [false, true, false, true, false, true]);
        // Both triangles of a square have its first corner.
        assert!(
            triangles.chunks(2).all(|pair| pair[0].iter().min() == pair[1].iter().min()),
            "{triangles:?}"
        );
    }
}
