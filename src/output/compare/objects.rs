//! Differences of two posed scenes, object by object.

#[cfg(test)]
mod tests;

use std::collections::HashMap;

use super::faces::match_faces;
use super::in_order::{InOrder, compare_in_order};
use super::scene_objects::Objects;
use blinn_core::geometry::Aabb;
use blinn_scene::PosedScene;

/// An object that differs between two scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectDifference {
    /// Name of the object.
    pub name: String,
    /// The kind of difference.
    pub change: ObjectChange,
    /// Bounds of the triangles that differ, in both scenes, in world coordinates.
    pub bounds: Aabb,
}

/// Kinds of differences of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectChange {
    /// Only the new scene has the object.
    Added {
        /// Number of its triangles.
        triangles: u64,
    },
    /// Only the old scene has the object.
    Removed {
        /// Number of its triangles.
        triangles: u64,
    },
    /// Other triangles, in whichever order.
    Rebuilt {
        /// Number of triangles in the old and in the new scene.
        triangles: [u64; 2],
        /// Triangles of each scene that the other one lacks.
        differing: [u64; 2],
        /// Distance of the surfaces in scene units: the largest distance of a corner, middle of an edge or centre of a
        /// differing triangle from the other surface. Infinite if there is no other surface.
        surface_distance: f64,
        /// True if normals, tangents, texture coordinates or colours of triangles that both have differ.
        attributes: bool,
        /// True if a material differs.
        material: bool,
    },
    /// The same triangles with other properties.
    Changed {
        /// Number of triangles with a corner elsewhere.
        moved_triangles: u64,
        /// Largest distance of a corner, in scene units.
        max_distance: f64,
        /// True if normals, tangents, texture coordinates or colours differ.
        attributes: bool,
        /// True if a material differs.
        material: bool,
    },
}

/// Compares the objects of two scenes that are posed around the same centre. Objects are matched by name, those of one
/// name in their order. Objects that are equal are left out.
pub fn compare_objects(old: &PosedScene, new: &PosedScene) -> Vec<ObjectDifference> {
    let [old, new] = [old, new].map(Objects::new);
    let mut of_new: HashMap<&str, Vec<usize>> = HashMap::new();
    for object in (0..new.instances.len()).rev() {
        of_new.entry(new.name(object)).or_default().push(object);
    }
    let mut differences = Vec::new();
    for object in 0..old.instances.len() {
        let name = old.name(object);
        let difference = match of_new.get_mut(name).and_then(Vec::pop) {
            Some(other) => compare_object(&old, object, &new, other),
            None => {
                let (triangles, bounds) = old.extent(object);
                Some((ObjectChange::Removed { triangles }, bounds))
            }
        };
        differences.extend(difference.map(|(change, bounds)| ObjectDifference {
            name: name.into(),
            change,
            bounds,
        }));
    }
    let mut added: Vec<usize> = of_new.into_values().flatten().collect();
    added.sort_unstable();
    differences.extend(added.into_iter().map(|object| {
        let (triangles, bounds) = new.extent(object);
        let name = new.name(object).to_string();
        ObjectDifference { name, change: ObjectChange::Added { triangles }, bounds }
    }));
    differences
}

fn compare_object(
    old: &Objects,
    old_object: usize,
    new: &Objects,
    new_object: usize,
) -> Option<(ObjectChange, Aabb)> {
    let precision = old.precision(old_object).max(new.precision(new_object));
    let in_order = compare_in_order(old, old_object, new, new_object, precision);
    if let Some(InOrder { moved_triangles: 0, attributes, material, .. }) = in_order {
        let change = ObjectChange::Changed { moved_triangles: 0, max_distance: 0.0, attributes, material };
        return (attributes || material).then(|| (change, old.extent(old_object).1));
    }
    // Exporters order triangles as they like.
    let mut numbers = HashMap::new();
    let old_faces = old.faces(old_object, &mut numbers);
    let new_faces = new.faces(new_object, &mut numbers);
    let triangles = [&old_faces, &new_faces].map(|faces| faces.len() as u64);
    let difference = match_faces(old_faces, new_faces);
    let material = difference.material || old.material_set(old_object) != new.material_set(new_object);
    let attributes = difference.attributes;
    let differing = difference.unmatched.each_ref().map(|faces| faces.len() as u64);
    match in_order {
        // As many moved as have no equal, and with their neighbours: the order is the same.
        Some(in_order) if in_order.is_same_order && differing == [in_order.moved_triangles; 2] => {
            let InOrder { moved_triangles, max_distance, attributes, material, bounds, .. } = in_order;
            let change = ObjectChange::Changed { moved_triangles, max_distance, attributes, material };
            Some((change, bounds))
        }
        _ if differing == [0, 0] => {
            let change =
                ObjectChange::Changed { moved_triangles: 0, max_distance: 0.0, attributes, material };
            (attributes || material).then(|| (change, old.extent(old_object).1))
        }
        _ => {
            let [before, after] = &difference.unmatched;
            let [before, after] = [old.corners_of(before), new.corners_of(after)];
            let to_new = new.surface(new_object).max_distance(&before);
            let to_old = old.surface(old_object).max_distance(&after);
            let mut bounds = Aabb::EMPTY;
            before.iter().chain(&after).flatten().for_each(|corner| bounds.extend(corner.as_dvec3()));
            let surface_distance = to_new.max(to_old);
            let change =
                ObjectChange::Rebuilt { triangles, differing, surface_distance, attributes, material };
            Some((change, old.to_world(bounds)))
        }
    }
}
