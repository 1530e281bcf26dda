//! Differences of objects whose triangles are in the same order.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use glam::{Vec2, Vec3, Vec4};

use super::scene_objects::Objects;
use blinn_core::geometry::Aabb;
use blinn_scene::{Mesh, PosedScene};

/// Differences of triangles at the same places of two files.
pub struct InOrder {
    /// Number of triangles with a corner elsewhere.
    pub moved_triangles: u64,
    /// Largest distance of a corner, in scene units.
    pub max_distance: f64,
    /// True if the triangles at the same places are most probably the same ones, and `max_distance` has a meaning.
    pub is_same_order: bool,
    /// True if normals, tangents, texture coordinates or colours differ.
    pub attributes: bool,
    /// True if a material differs.
    pub material: bool,
    /// Bounds of the moved triangles in both scenes, in world coordinates.
    pub bounds: Aabb,
}

/// Compares two objects triangle by triangle; `None` if their parts have other sizes. Corners that moved together may be
/// `precision` apart.
pub fn compare_in_order(
    old: &Objects,
    old_object: usize,
    new: &Objects,
    new_object: usize,
    precision: f64,
) -> Option<InOrder> {
    let (parts, others) = (&old.instances[old_object], &new.instances[new_object]);
    let sizes = |objects: &Objects, parts: &[u32]| -> Vec<usize> {
        parts.iter().map(|&part| objects.mesh_size(part)).collect()
    };
    if sizes(old, parts) != sizes(new, others) {
        return None;
    }
    let mut total = 0;
    let mut moved_triangles = 0;
    let mut max_distance = 0f64;
    let (mut attributes, mut material) = (false, false);
    let mut bounds = Aabb::EMPTY;
    let mut moves = CornerMoves::default();
    for (&a, &b) in parts.iter().zip(others) {
        for triangle in 0..old.mesh_size(a) {
            total += 1;
            let (before, after) = (old.corners(a, triangle), new.corners(b, triangle));
            if is_same(&before, &after) {
                continue;
            }
            moved_triangles += 1;
            for (p, q) in before.into_iter().zip(after) {
                // Infinite if a corner became invalid.
                let distance = f64::from(p.distance(q));
                max_distance = max_distance.max(if distance.is_nan() { f64::INFINITY } else { distance });
                bounds.extend(p.as_dvec3());
                bounds.extend(q.as_dvec3());
                moves.add(p, q, total, precision);
            }
        }
        attributes |= !has_same_attributes(old.posed, a, new.posed, b);
        material |= old.material(a) != new.material(b);
    }
    let is_same_order = moves.agree(moved_triangles, total);
    let bounds = old.to_world(bounds);
    Some(InOrder { moved_triangles, max_distance, is_same_order, attributes, material, bounds })
}

/// The places to which corners moved. Triangles that share a corner still share it if they are in the same order, and
/// hardly ever if they are in another one.
#[derive(Default)]
struct CornerMoves {
    /// The new place of each old one, and the triangle that had it first.
    places: HashMap<[u32; 3], (Vec3, u64)>,
    /// True if triangles share a corner.
    is_shared: bool,
    /// True if triangles no longer share a corner.
    is_torn: bool,
}

impl CornerMoves {
    fn add(&mut self, old: Vec3, new: Vec3, triangle: u64, precision: f64) {
        if self.is_torn {
            return;
        }
        // -0 is 0.
        match self.places.entry((old + 0.0).to_array().map(f32::to_bits)) {
            Entry::Vacant(entry) => {
                entry.insert((new, triangle));
            }
            Entry::Occupied(entry) => {
                let (place, first) = *entry.get();
                self.is_shared |= first != triangle;
                // NaN is nowhere.
                self.is_torn = !(f64::from(place.distance(new)) <= precision);
            }
        }
    }

    /// Returns true if the triangles are in the same order. Where none share corners, most of them must be in place.
    fn agree(&self, moved: u64, total: u64) -> bool {
        !self.is_torn && (self.is_shared || total == 1 || 2 * moved <= total)
    }
}

fn is_same(a: &[Vec3; 3], b: &[Vec3; 3]) -> bool {
    a.map(|p| p.to_array().map(f32::to_bits)) == b.map(|p| p.to_array().map(f32::to_bits)) || a == b
}

/// Compares normals, tangents, texture coordinates and colours at the corners of triangles, so that the order of the
/// vertices does not count.
fn has_same_attributes(old: &PosedScene, a: u32, new: &PosedScene, b: u32) -> bool {
    let (mesh, other) = (old.mesh(a), new.mesh(b));
    let color = |posed: &PosedScene, i: u32| posed.scene.instances[i as usize].color;
    let same_uvs = || {
        let (uvs, others) = (old.uvs(a), new.uvs(b));
        let pairs = uvs.iter().zip(others);
        let flat = |uv: &Vec2| uv.extend(0.0).extend(0.0);
        uvs.len() == others.len() && pairs.into_iter().all(|(x, y)| same_at_corners(mesh, x, other, y, flat))
    };
    let wide = |v: &Vec3| v.extend(0.0);
    let whole = |v: &Vec4| *v;
    color(old, a) == color(new, b)
        && same_uvs()
        && same_at_corners(mesh, old.normals(a), other, new.normals(b), wide)
        && same_at_corners(mesh, old.tangents(a), other, new.tangents(b), whole)
        && same_at_corners(mesh, old.colors(a), other, new.colors(b), whole)
}

fn same_at_corners<T>(
    mesh: &Mesh,
    values: &[T],
    other: &Mesh,
    others: &[T],
    to_vec4: impl Fn(&T) -> Vec4,
) -> bool {
    if values.is_empty() || others.is_empty() {
        return values.is_empty() == others.is_empty();
    }
    let at = |values: &[T], i: u32| values.get(i as usize).map(|v| to_vec4(v).to_array().map(f32::to_bits));
    let count = mesh.primitive_count().min(other.primitive_count()) as u32;
    let mut corners = (0..count).flat_map(|k| mesh.corners(k).into_iter().zip(other.corners(k)));
    corners.all(|(i, j)| at(values, i) == at(others, j))
}
