//! Leaf groups: boxes that certainly share a block of a leaf, found by the first rounds of PLOC.
//!
//! The conversion never splits a subtree of as few entries as a block holds. So PLOC's merges within that limit can be
//! made first, on arrays of coordinates, and the builder gets a third as many boxes.

use glam::Vec3A;
use obvhs::aabb::Aabb as ObvhsAabb;

use blinn_core::simd::{AutovecKernel, SimdLevel};

/// Neighbours before and after a group that are considered for a merge: PLOC's search distance.
const SEARCH_DISTANCE: usize = 6;

/// Rounds of merges. Later ones would find hardly any that fit.
const ROUNDS: usize = 4;

/// Groups of boxes.
pub(crate) struct LeafGroups {
    /// Bounds of each group.
    pub boxes: Vec<ObvhsAabb>,
    /// Number of leaf entries in each group.
    entries: Vec<u32>,
    /// Indices of the boxes of all groups, group by group.
    members: Vec<u32>,
    /// End of each group's range in `members`.
    ends: Vec<u32>,
}

impl LeafGroups {
    /// Groups boxes in the order of a space-filling curve. Groups of several boxes have at most `max_entries`.
    pub fn new(boxes: &[ObvhsAabb], entry_count: impl Fn(u32) -> u32, max_entries: u32) -> LeafGroups {
        if max_entries <= 1 {
            return LeafGroups::single_boxes(boxes, entry_count);
        }
        let mut forming = FormingGroups::new(boxes, entry_count);
        let simd = SimdLevel::detect();
        let mut search = NeighbourSearch::default();
        for _ in 0..ROUNDS {
            if forming.entries.len() < 2 {
                break;
            }
            search.find(&forming.planes, simd);
            forming.merge_mutual_neighbours(&search.nearest, max_entries);
        }
        forming.finish()
    }

    /// Makes a group of each box.
    pub fn single_boxes(boxes: &[ObvhsAabb], entry_count: impl Fn(u32) -> u32) -> LeafGroups {
        let count = boxes.len() as u32;
        LeafGroups {
            boxes: boxes.to_vec(),
            entries: (0..count).map(entry_count).collect(),
            members: (0..count).collect(),
            ends: (1..=count).collect(),
        }
    }

    /// Number of leaf entries in a group.
    #[inline(always)]
    pub fn entry_count(&self, group: u32) -> u32 {
        self.entries[group as usize]
    }

    /// Indices of the boxes of a group.
    pub fn members(&self, group: u32) -> &[u32] {
        let group = group as usize;
        let start = if group == 0 { 0 } else { self.ends[group - 1] };
        &self.members[start as usize..self.ends[group] as usize]
    }
}

/// Coordinates of bounds by side (min, max) and axis.
type Planes = [[Vec<f32>; 3]; 2];

/// Groups between two rounds, in structure-of-arrays form.
struct FormingGroups {
    planes: Planes,
    entries: Vec<u32>,
    /// First and last box of each group.
    first: Vec<u32>,
    last: Vec<u32>,
    /// The box that follows each one in its group.
    next: Vec<u32>,
}

/// Ends the list of a group's boxes.
const END: u32 = u32::MAX;

impl FormingGroups {
    fn new(boxes: &[ObvhsAabb], entry_count: impl Fn(u32) -> u32) -> FormingGroups {
        let count = boxes.len() as u32;
        let mut planes: Planes = Default::default();
        planes.iter_mut().flatten().for_each(|plane| plane.resize(boxes.len(), 0.0));
        for (i, bounds) in boxes.iter().enumerate() {
            for axis in 0..3 {
                planes[0][axis][i] = bounds.min[axis];
                planes[1][axis][i] = bounds.max[axis];
            }
        }
        FormingGroups {
            planes,
            entries: (0..count).map(entry_count).collect(),
            first: (0..count).collect(),
            last: (0..count).collect(),
            next: vec![END; boxes.len()],
        }
    }

    /// Merges neighbours that are each other's nearest, where they fit together.
    fn merge_mutual_neighbours(&mut self, nearest: &[u32], max_entries: u32) {
        let mut kept: Vec<u32> = Vec::with_capacity(nearest.len());
        let mut merges: Vec<[usize; 2]> = Vec::with_capacity(nearest.len() / 2);
        for (i, &other) in nearest.iter().enumerate() {
            let other = other as usize;
            let merges_with_other = nearest[other] as usize == i
                && self.entries[i].saturating_add(self.entries[other]) <= max_entries;
            // The earlier of both takes the place.
            if merges_with_other && other < i {
                continue;
            }
            if merges_with_other {
                merges.push([i, other]);
            }
            kept.push(i as u32);
        }
        for &[a, b] in &merges {
            self.next[self.last[a] as usize] = self.first[b];
            self.last[a] = self.last[b];
            self.entries[a] += self.entries[b];
        }
        let [min_planes, max_planes] = &mut self.planes;
        for plane in min_planes {
            merges.iter().for_each(|&[a, b]| plane[a] = lesser(plane[a], plane[b]));
            keep(plane, &kept);
        }
        for plane in max_planes {
            merges.iter().for_each(|&[a, b]| plane[a] = greater(plane[a], plane[b]));
            keep(plane, &kept);
        }
        keep(&mut self.entries, &kept);
        keep(&mut self.first, &kept);
        keep(&mut self.last, &kept);
    }

    fn finish(self) -> LeafGroups {
        let FormingGroups { planes: [[min_x, min_y, min_z], [max_x, max_y, max_z]], entries, .. } = self;
        let count = entries.len();
        let bounds = |i: usize| ObvhsAabb {
            min: Vec3A::new(min_x[i], min_y[i], min_z[i]),
            max: Vec3A::new(max_x[i], max_y[i], max_z[i]),
        };
        let mut groups = LeafGroups {
            boxes: (0..count).map(bounds).collect(),
            entries,
            members: Vec::with_capacity(self.next.len()),
            ends: Vec::with_capacity(count),
        };
        for mut member in self.first {
            while member != END {
                groups.members.push(member);
                member = self.next[member as usize];
            }
            groups.ends.push(groups.members.len() as u32);
        }
        groups
    }
}

/// Moves the elements with these ascending indices to the front and removes the others.
fn keep<T: Copy>(values: &mut Vec<T>, kept: &[u32]) {
    for (to, &from) in kept.iter().enumerate() {
        values[to] = values[from as usize];
    }
    values.truncate(kept.len());
}

/// The lesser of two numbers; unlike `min`, one instruction.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers; unlike `max`, one instruction.
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The nearest neighbours of groups.
///
/// A key is the half area of two groups together, with their distance along the curve and the parity of the earlier one in
/// its lowest bits: among equal areas, pairs that begin at even indices come first.
#[derive(Default)]
struct NeighbourSearch {
    /// The least key of each group with a later one.
    forward: Vec<f32>,
    /// The least key of each group with an earlier one.
    backward: Vec<f32>,
    /// The nearest neighbour of each group.
    nearest: Vec<u32>,
}

/// Bits of a key below those of the area.
const KEY_BITS: u32 = 4;

impl NeighbourSearch {
    /// Finds the nearest neighbours of two groups or more. They are the same at every SIMD level.
    fn find(&mut self, planes: &Planes, simd: SimdLevel) {
        let count = planes[0][0].len();
        for keys in [&mut self.forward, &mut self.backward] {
            keys.clear();
            keys.resize(count, f32::MAX);
        }
        self.nearest.resize(count, 0);
        simd.run(FindNearest { planes, search: self });
    }
}

/// [`NeighbourSearch::find`] as a kernel.
struct FindNearest<'a> {
    planes: &'a Planes,
    search: &'a mut NeighbourSearch,
}

impl AutovecKernel for FindNearest<'_> {
    #[inline(always)]
    fn run(self) {
        let FindNearest { planes: [min_planes, max_planes], search } = self;
        let NeighbourSearch { forward, backward, nearest } = search;
        let count = forward.len();
        for distance in 1..=SEARCH_DISTANCE.min(count - 1) {
            let pairs = count - distance;
            let [min_x, min_y, min_z] = min_planes.each_ref().map(|plane| &plane[..pairs]);
            let [max_x, max_y, max_z] = max_planes.each_ref().map(|plane| &plane[..pairs]);
            let [later_min_x, later_min_y, later_min_z] =
                min_planes.each_ref().map(|plane| &plane[distance..][..pairs]);
            let [later_max_x, later_max_y, later_max_z] =
                max_planes.each_ref().map(|plane| &plane[distance..][..pairs]);
            let forward = &mut forward[..pairs];
            let backward = &mut backward[distance..][..pairs];
            for i in 0..pairs {
                let x = greater(max_x[i], later_max_x[i]) - lesser(min_x[i], later_min_x[i]);
                let y = greater(max_y[i], later_max_y[i]) - lesser(min_y[i], later_min_y[i]);
                let z = greater(max_z[i], later_max_z[i]) - lesser(min_z[i], later_min_z[i]);
                let half_area = x * y + y * z + z * x;
                let low_bits = 2 * distance as u32 + (i as u32 & 1);
                let key = f32::from_bits(half_area.to_bits() & (u32::MAX << KEY_BITS) | low_bits);
                forward[i] = lesser(key, forward[i]);
                backward[i] = lesser(key, backward[i]);
            }
        }
        let backward = &backward[..count];
        let nearest = &mut nearest[..count];
        for i in 0..count {
            let key = lesser(backward[i], forward[i]);
            let distance = (key.to_bits() & ((1 << KEY_BITS) - 1)) / 2;
            nearest[i] = if backward[i] < forward[i] { i as u32 - distance } else { i as u32 + distance };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(x: f32, y: f32, size: f32) -> ObvhsAabb {
        let min = Vec3A::new(x, y, 0.0);
        ObvhsAabb { min, max: min + size }
    }

    /// Boxes of all sizes at random places.
    fn random_boxes(count: u32) -> Vec<ObvhsAabb> {
        let random = |i: u32| (i.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        (0..count).map(|i| cube(random(3 * i), random(3 * i + 1), 0.1 * random(3 * i + 2))).collect()
    }

    #[test]
    fn each_box_is_in_one_group_that_bounds_it_and_holds_no_more_than_allowed() {
        let entry_count = |i: u32| if i.is_multiple_of(9) { 7 } else { 1 + i % 2 };
        for (count, max_entries) in [(0, 4), (1, 4), (2, 4), (5, 2), (1000, 1), (1000, 4), (1000, 8)] {
            let boxes = random_boxes(count);
            let groups = LeafGroups::new(&boxes, entry_count, max_entries);
            let mut found = vec![0; boxes.len()];
            for (group, bounds) in (0..).zip(&groups.boxes) {
                let members = groups.members(group);
                let entries = members.iter().map(|&i| entry_count(i)).sum::<u32>();
                assert_eq!(groups.entry_count(group), entries);
                assert!(members.len() == 1 || entries <= max_entries);
                let union = members.iter().fold(ObvhsAabb::INVALID, |all, &i| all.union(&boxes[i as usize]));
                assert_eq!((bounds.min, bounds.max), (union.min, union.max));
                members.iter().for_each(|&i| found[i as usize] += 1);
            }
            assert!(found.iter().all(|&times| times == 1));
            assert!(max_entries == 1 || count < 1000 || groups.boxes.len() < boxes.len() * 3 / 4);
        }
    }

    /// Among equal areas, some neighbours must still be each other's nearest.
    #[test]
    fn equal_boxes_at_equal_distances_fill_groups() {
        let row: Vec<ObvhsAabb> = (0..64).map(|i| cube(i as f32, 0.0, 1.0)).collect();
        let groups = LeafGroups::new(&row, |_| 1, 4);
        assert_eq!(groups.boxes.len(), 16);
        assert_eq!(groups.members(3), [12, 13, 14, 15]);
    }

    #[test]
    fn neighbours_are_the_same_at_every_simd_level() {
        for count in [2, 3, 7, 8, 9, 500] {
            let forming = FormingGroups::new(&random_boxes(count), |_| 1);
            let nearest = SimdLevel::ALL.map(|level| {
                let mut search = NeighbourSearch::default();
                search.find(&forming.planes, level);
                search.nearest
            });
            assert!(nearest.iter().all(|other| *other == nearest[0]), "{count}");
        }
    }
}
