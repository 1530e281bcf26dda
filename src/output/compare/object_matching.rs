//! Matches the objects of two scenes.

use std::collections::HashMap;

use super::scene_objects::Objects;
use blinn_core::geometry::Aabb;

/// Largest distance of the bounds of objects with other names that belong together, as a share of their size.
const NEAR: f64 = 0.25;

/// The objects of two scenes that belong together.
pub struct ObjectMatches {
    /// Visible old objects, each with the new one.
    pub old: Vec<(usize, Option<usize>)>,
    /// Visible new objects that no old one is.
    pub added: Vec<usize>,
}

/// Matches objects by name, those of one name in their order. Objects that are left are matched by equal triangles, then by
/// the nearest bounds. A single object of each scene is the same one.
pub fn match_objects(old: &Objects, new: &Objects) -> ObjectMatches {
    let [of_old, of_new] = [old, new].map(visible);
    let is_single = of_old.len() == 1 && of_new.len() == 1;
    let mut by_name: HashMap<&str, Vec<usize>> = HashMap::new();
    of_new.into_iter().rev().for_each(|object| by_name.entry(new.name(object)).or_default().push(object));
    let mut matches: Vec<(usize, Option<usize>)> = of_old
        .into_iter()
        .map(|object| (object, by_name.get_mut(old.name(object)).and_then(Vec::pop)))
        .collect();
    let mut added: Vec<usize> = by_name.into_values().flatten().collect();
    added.sort_unstable();
    let is_left = matches.iter().any(|(_, other)| other.is_none());
    if is_left && is_single {
        matches[0].1 = added.pop();
    } else if is_left && !added.is_empty() {
        match_equal(old, new, &mut matches, &mut added);
        match_nearest(old, new, &mut matches, &mut added);
    }
    ObjectMatches { old: matches, added }
}

fn visible(objects: &Objects) -> Vec<usize> {
    (0..objects.instances.len()).filter(|object| !objects.instances[*object].is_empty()).collect()
}

fn match_equal(old: &Objects, new: &Objects, matches: &mut [(usize, Option<usize>)], added: &mut Vec<usize>) {
    let mut by_digest: HashMap<u128, Vec<usize>> = HashMap::new();
    for &object in added.iter().rev() {
        by_digest.entry(new.geometry_digest(object)).or_default().push(object);
    }
    for (object, other) in matches.iter_mut().filter(|(_, other)| other.is_none()) {
        *other = by_digest.get_mut(&old.geometry_digest(*object)).and_then(Vec::pop);
        added.retain(|left| Some(*left) != *other);
    }
}

fn match_nearest(
    old: &Objects,
    new: &Objects,
    matches: &mut [(usize, Option<usize>)],
    added: &mut Vec<usize>,
) {
    let mut left: Vec<(usize, Aabb)> = added.iter().map(|&object| (object, new.extent(object).1)).collect();
    for (object, other) in matches.iter_mut().filter(|(_, other)| other.is_none()) {
        let bounds = old.extent(*object).1;
        let distances = left.iter().enumerate().map(|(i, (_, candidate))| (i, distance(&bounds, candidate)));
        let nearest = distances.min_by(|(_, a), (_, b)| a.total_cmp(b));
        if let Some((i, _)) = nearest.filter(|(_, distance)| *distance <= NEAR) {
            *other = Some(left.remove(i).0);
        }
    }
    *added = left.into_iter().map(|(object, _)| object).collect();
}

/// The largest distance of corners of boxes along an axis, as a share of their size. Infinite for empty boxes.
fn distance(a: &Aabb, b: &Aabb) -> f64 {
    let apart = (a.min - b.min).abs().max((a.max - b.max).abs()).max_element();
    let size = a.extent().max(b.extent()).max_element();
    let share = apart / size;
    if a.is_empty() || b.is_empty() || share.is_nan() { f64::INFINITY } else { share }
}
