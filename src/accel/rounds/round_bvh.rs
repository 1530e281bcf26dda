//! An eight-wide BVH without pointers over points or line segments.
//!
//! The items are sorted so that each aligned group of eight, of 64, of 512 and so on is compact: they are halved about a
//! median along the longest side of their bounds, again and again. A leaf is a group of eight. The nodes of a level lie in a row,
//! and node i has the children 8 i to 8 i + 7 of the level below.

use std::cmp::Ordering;

use glam::Vec3;
use rayon::prelude::*;

use super::items::RoundItem;

/// Items of a leaf, and children of a node.
pub(super) const WIDTH: usize = 8;
/// Items that one thread sorts.
const MIN_PARALLEL: usize = 1 << 13;

/// The boxes of the children of a node; empty boxes where it has none.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoundNode {
    pub min: [[f32; WIDTH]; 3],
    pub max: [[f32; WIDTH]; 3],
}

impl RoundNode {
    /// No children.
    pub const EMPTY: RoundNode =
        RoundNode { min: [[f32::INFINITY; WIDTH]; 3], max: [[f32::NEG_INFINITY; WIDTH]; 3] };

    /// Sets the box of a child.
    #[inline(always)]
    pub fn set(&mut self, child: usize, [min, max]: [Vec3; 2]) {
        for axis in 0..3 {
            self.min[axis][child] = min[axis];
            self.max[axis][child] = max[axis];
        }
    }

    fn bounds(&self) -> [Vec3; 2] {
        let least = |row: &[f32; WIDTH]| row.iter().copied().fold(f32::INFINITY, f32::min);
        let most = |row: &[f32; WIDTH]| row.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        [Vec3::from(self.min.each_ref().map(least)), Vec3::from(self.max.each_ref().map(most))]
    }
}

/// The BVH.
#[derive(Debug)]
pub(super) struct RoundBvh<T> {
    items: Vec<T>,
    /// The nodes by level, from those above leaves to the root.
    levels: Vec<Vec<RoundNode>>,
    /// The bounds of all items, without their radii.
    bounds: [Vec3; 2],
}

impl<T: RoundItem> RoundBvh<T> {
    /// Builds the BVH. It depends on the order of the items, but on no threads. Of items of the same place that `is_same` says
    /// no ray can tell apart, all but the first may be left out: a ray that hits one would have to visit them all.
    pub fn build(mut items: Vec<T>, is_same: impl Fn(&T, &T) -> bool) -> RoundBvh<T> {
        sort(&mut items);
        if remove_repeated(&mut items, is_same) {
            items.shrink_to_fit();
            sort(&mut items);
        }
        let mut levels: Vec<Vec<RoundNode>> = Vec::new();
        if !items.is_empty() {
            let node = |items: &[T]| {
                let mut node = RoundNode::EMPTY;
                let leaves = items.chunks(WIDTH).enumerate();
                leaves.for_each(|(child, leaf)| node.set(child, bounds(leaf)));
                node
            };
            levels.push(items.par_chunks(WIDTH * WIDTH).map(node).collect());
        }
        while let Some(below) = levels.last().filter(|level| level.len() > 1) {
            let node = |nodes: &[RoundNode]| {
                let mut node = RoundNode::EMPTY;
                nodes.iter().enumerate().for_each(|(child, below)| node.set(child, below.bounds()));
                node
            };
            levels.push(below.par_chunks(WIDTH).map(node).collect());
        }
        let root = levels.last().and_then(|level| level.first());
        let bounds = root.map_or([Vec3::ZERO; 2], RoundNode::bounds);
        RoundBvh { items, levels, bounds }
    }

    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// Returns the items of a leaf.
    #[inline(always)]
    pub fn leaf(&self, leaf: usize) -> &[T] {
        &self.items[leaf * WIDTH..self.items.len().min((leaf + 1) * WIDTH)]
    }

    /// Returns the number of levels of nodes.
    #[inline(always)]
    pub fn level_count(&self) -> usize {
        self.levels.len()
    }

    /// Returns a node.
    #[inline(always)]
    pub fn node(&self, level: usize, index: usize) -> &RoundNode {
        &self.levels[level][index]
    }

    /// Returns the bounds of all items, without their radii.
    pub fn bounds(&self) -> [Vec3; 2] {
        self.bounds
    }

    pub fn bytes(&self) -> usize {
        let nodes: usize = self.levels.iter().map(Vec::len).sum();
        size_of_val(&self.items[..]) + nodes * size_of::<RoundNode>()
    }
}

/// Removes all but the first of neighbours in the same place. Returns true if it has removed some.
fn remove_repeated<T: RoundItem>(items: &mut Vec<T>, is_same: impl Fn(&T, &T) -> bool) -> bool {
    let count = items.len();
    items.dedup_by(|next, kept| {
        let repeats = next.is_at_place_of(kept) && is_same(next, kept);
        if repeats && next.id() < kept.id() {
            *kept = *next;
        }
        repeats
    });
    items.len() < count
}

fn bounds<T: RoundItem>(items: &[T]) -> [Vec3; 2] {
    let empty = [Vec3::INFINITY, Vec3::NEG_INFINITY];
    items.iter().fold(empty, |[min, max], item| {
        let [low, high] = item.bounds();
        [min.min(low), max.max(high)]
    })
}

/// Sorts items so that aligned groups are compact.
fn sort<T: RoundItem>(items: &mut [T]) {
    if items.len() <= WIDTH {
        return;
    }
    let half = (WIDTH * items.len().div_ceil(WIDTH).next_power_of_two()) / 2;
    let [min, max] = bounds(items);
    let axis = (max - min).max_position();
    let key = |item: &T| {
        let [low, high] = item.bounds();
        low[axis] + high[axis]
    };
    let order = |a: &T, b: &T| match key(a).total_cmp(&key(b)) {
        Ordering::Equal => a.id().cmp(&b.id()),
        order => order,
    };
    items.select_nth_unstable_by(half, order);
    let is_large = items.len() > MIN_PARALLEL;
    let (left, right) = items.split_at_mut(half);
    // Halves: as deep as the logarithm of their number.
    if is_large {
        rayon::join(|| sort(left), || sort(right));
    } else {
        sort(left);
        sort(right);
    }
}
