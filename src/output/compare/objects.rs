//! Differences of two posed scenes, object by object.

#[cfg(test)]
mod tests;

use std::collections::HashMap;

use super::element_kind::ElementKind;
use super::faces::{are_reversed, match_faces};
use super::in_order::{InOrder, compare_in_order};
use super::object_matching::match_objects;
use super::scene_objects::Objects;
use super::surface_distance::Apart;
use blinn_core::geometry::Aabb;
use blinn_scene::PosedScene;

/// An object that differs between two scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectDifference {
    /// Name of the object, in the old scene if it has it.
    pub name: String,
    /// Its name in the new scene, if that is another one.
    pub renamed: Option<String>,
    /// Kind of the elements of the object, in both scenes.
    pub elements: ElementKind,
    /// The kind of difference.
    pub change: ObjectChange,
    /// Bounds of the places where the surfaces are apart, in world coordinates (y up). Where they are not, or where triangles
    /// moved one by one, bounds of the triangles that differ, in both scenes.
    pub bounds: Aabb,
}

/// Kinds of differences of an object. Elements are triangles, points or lines ([`ElementKind`]).
#[derive(Clone, Debug, PartialEq)]
pub enum ObjectChange {
    /// Only the new scene has the object.
    Added {
        /// Number of its elements.
        count: u64,
    },
    /// Only the old scene has the object.
    Removed {
        /// Number of its elements.
        count: u64,
    },
    /// Other elements, in whichever order.
    Rebuilt {
        /// Number of elements in the old and in the new scene.
        counts: [u64; 2],
        /// Elements of each scene that the other one lacks.
        differing: [u64; 2],
        /// Distance of the surfaces in scene units: the largest distance of a corner, middle of an edge or centre of a
        /// differing element from the other surface. 0 up to the precision of the coordinates, infinite if there is
        /// no other surface.
        surface_distance: f64,
        /// True if normals, tangents, texture coordinates or colours of elements that both have differ.
        attributes: bool,
        /// True if a material differs.
        material: bool,
    },
    /// The same triangles, of which some wind the other way: their front and back sides are swapped.
    Reversed {
        /// Number of these triangles.
        triangles: u64,
        /// True if normals, tangents, texture coordinates or colours of other triangles differ.
        attributes: bool,
        /// True if a material differs.
        material: bool,
    },
    /// The same elements with other properties.
    Changed {
        /// Number of elements with a corner elsewhere.
        moved: u64,
        /// Largest distance of a corner, in scene units.
        max_distance: f64,
        /// True if normals, tangents, texture coordinates or colours differ.
        attributes: bool,
        /// True if a material differs.
        material: bool,
    },
}

/// The differences of the objects of two scenes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjectComparison {
    /// The objects that differ.
    pub differences: Vec<ObjectDifference>,
    /// Largest distance that was accepted, in scene units; `None` if all other objects have equal coordinates.
    pub accepted_distance: Option<f64>,
}

/// Compares the objects of two scenes that are posed around the same centre. Objects are matched by name, others by
/// their triangles. Objects that are equal are left out.
///
/// Corners that moved by no more than the precision of the coordinates are equal. With a `tolerance`, in scene units, so
/// are surfaces that are no farther apart, whatever their triangles.
pub fn compare_objects(old: &PosedScene, new: &PosedScene, tolerance: Option<f64>) -> ObjectComparison {
    let [old, new] = [old, new].map(Objects::new);
    let matches = match_objects(&old, &new);
    let mut comparison = ObjectComparison::default();
    for (object, other) in matches.old {
        let Some(other) = other else {
            let (count, bounds) = old.extent(object);
            let change = ObjectChange::Removed { count };
            let (name, elements) = (old.name(object).into(), old.element_kind(object));
            comparison.differences.push(ObjectDifference { name, renamed: None, elements, change, bounds });
            continue;
        };
        let pair = ObjectPair { old: &old, old_object: object, new: &new, new_object: other };
        let outcome = pair.compare(tolerance);
        comparison.accept(outcome.accepted_distance);
        let renamed = pair.new_name();
        let change =
            outcome.change.or_else(|| renamed.is_some().then(|| pair.changed_in_place(false, false)));
        comparison.differences.extend(change.map(|(change, bounds)| ObjectDifference {
            name: old.name(object).into(),
            renamed,
            elements: old.element_kind(object).join(new.element_kind(other)),
            change,
            bounds,
        }));
    }
    comparison.differences.extend(matches.added.into_iter().map(|object| {
        let (count, bounds) = new.extent(object);
        let name = new.name(object).to_string();
        let (elements, change) = (new.element_kind(object), ObjectChange::Added { count });
        ObjectDifference { name, renamed: None, elements, change, bounds }
    }));
    comparison
}

impl ObjectComparison {
    fn accept(&mut self, distance: Option<f64>) {
        let larger = |distance: f64| self.accepted_distance.map_or(distance, |other| other.max(distance));
        self.accepted_distance = distance.map(larger).or(self.accepted_distance);
    }
}

/// An object of both scenes.
struct ObjectPair<'a> {
    old: &'a Objects<'a>,
    old_object: usize,
    new: &'a Objects<'a>,
    new_object: usize,
}

/// The outcome of a comparison of an object.
#[derive(Default)]
struct Outcome {
    /// The difference, if there is one, and its bounds.
    change: Option<(ObjectChange, Aabb)>,
    /// The distance that was accepted, if any.
    accepted_distance: Option<f64>,
}

impl ObjectPair<'_> {
    fn compare(&self, tolerance: Option<f64>) -> Outcome {
        let &ObjectPair { old, old_object, new, new_object } = self;
        let precision = old.precision(old_object).max(new.precision(new_object));
        let accepted = tolerance.unwrap_or(0.0).max(precision);
        let in_order = compare_in_order(old, old_object, new, new_object, precision);
        if let Some(InOrder { moved_triangles, max_distance, attributes, material, .. }) = in_order
            && max_distance <= accepted
        {
            let accepted_distance = (moved_triangles > 0).then_some(max_distance);
            return Outcome { change: self.in_place(attributes, material), accepted_distance };
        }
        // Exporters order triangles as they like.
        let mut numbers = HashMap::new();
        let old_faces = old.faces(old_object, &mut numbers);
        let new_faces = new.faces(new_object, &mut numbers);
        let counts = [&old_faces, &new_faces].map(|faces| faces.len() as u64);
        let difference = match_faces(old_faces, new_faces);
        let material = difference.material || old.material_set(old_object) != new.material_set(new_object);
        let attributes = difference.attributes;
        let differing = difference.unmatched.each_ref().map(|faces| faces.len() as u64);
        let [before, after] = &difference.unmatched;
        let [before, after] = [old.corners_of(before), new.corners_of(after)];
        let find_apart = || {
            let to_new = new.surface(new_object).compare(&before, accepted);
            to_new.join(old.surface(old_object).compare(&after, accepted))
        };
        let apart = (tolerance.is_some() && differing != [0, 0]).then(find_apart);
        if let Some(Apart { distance, .. }) = apart.filter(|apart| apart.distance <= accepted) {
            let change = self.in_place(attributes, material);
            return Outcome { change, accepted_distance: Some(distance) };
        }
        if differing != [0, 0] && are_reversed(&before, &after) {
            let mut bounds = Aabb::EMPTY;
            before.iter().flatten().for_each(|corner| bounds.extend(corner.as_dvec3()));
            let change = ObjectChange::Reversed { triangles: differing[0], attributes, material };
            return Outcome { change: Some((change, old.to_world(bounds))), accepted_distance: None };
        }
        match in_order {
            // As many moved as have no equal, and with their neighbours: the order is the same.
            Some(in_order) if in_order.is_same_order && differing == [in_order.moved_triangles; 2] => {
                let InOrder { moved_triangles: moved, max_distance, attributes, material, bounds, .. } =
                    in_order;
                let change = ObjectChange::Changed { moved, max_distance, attributes, material };
                Outcome { change: Some((change, bounds)), accepted_distance: None }
            }
            _ if differing == [0, 0] => {
                Outcome { change: self.in_place(attributes, material), accepted_distance: None }
            }
            _ => {
                let apart = apart.unwrap_or_else(find_apart);
                // On the same surface, the triangles that differ are all there is to see.
                let mut bounds = apart.bounds;
                if bounds.is_empty() {
                    before.iter().chain(&after).flatten().for_each(|corner| bounds.extend(corner.as_dvec3()));
                }
                let surface_distance = if apart.distance <= accepted { 0.0 } else { apart.distance };
                let change =
                    ObjectChange::Rebuilt { counts, differing, surface_distance, attributes, material };
                Outcome { change: Some((change, old.to_world(bounds))), accepted_distance: None }
            }
        }
    }

    /// The name of the new object, if it is another one.
    fn new_name(&self) -> Option<String> {
        let name = self.new.name(self.new_object);
        (name != self.old.name(self.old_object)).then(|| name.to_string())
    }

    /// The change of an object whose triangles are at their places, if there is one.
    fn in_place(&self, attributes: bool, material: bool) -> Option<(ObjectChange, Aabb)> {
        (attributes || material).then(|| self.changed_in_place(attributes, material))
    }

    fn changed_in_place(&self, attributes: bool, material: bool) -> (ObjectChange, Aabb) {
        let change = ObjectChange::Changed { moved: 0, max_distance: 0.0, attributes, material };
        (change, self.old.extent(self.old_object).1)
    }
}
