//! Leaves of one wide node that share out again what they hold, so that fewer blocks hold it all.
//!
//! A binary tree's leaves are as full as its branches happen to be: of a block's four places hardly more than
//! three are taken. But blocks are most of what a tree weighs, and in which leaf of a wide node something is
//! matters little to rays.

use obvhs::aabb::Aabb as ObvhsAabb;

use crate::accel::bvh::bvh8::WIDTH;
use crate::accel::bvh::triangle4::TRIANGLE_LANES;

/// What a leaf costs for each block, and for each entry.
const BLOCK_COST: f32 = 0.6;
const ENTRY_COST: f32 = 0.2;

/// A leaf goes where that costs the others at most so many times what it costs itself.
const MOST: f32 = 2.5;

/// Most boxes of a leaf.
const BOXES: usize = 2 * TRIANGLE_LANES;

/// How many entries fit: into a block, where they are looked at together, one, two or four; and into a leaf, at
/// most eight. One box may have more than a leaf, and is a leaf of its own then.
#[derive(Clone, Copy)]
pub(crate) struct Capacity {
    pub block: u32,
    pub leaf: u32,
}

impl Capacity {
    /// Of leaves that have one thing each.
    pub const ONE: Capacity = Capacity { block: 1, leaf: 1 };
    /// Of leaves that have one or two blocks.
    pub const BLOCKS: Capacity = Capacity { block: TRIANGLE_LANES as u32, leaf: BOXES as u32 };

    /// How many more a leaf can take without another block.
    fn room(self, leaf: &Shape) -> u32 {
        if leaf.entries > self.leaf { 0 } else { leaf.entries.wrapping_neg() & (self.block - 1) }
    }
}

/// A box, how many entries it has, and what it costs rays as a leaf, in units of what visiting a node of the same
/// box does, times the box's half area.
#[derive(Clone, Copy)]
pub(crate) struct Shape {
    pub bounds: ObvhsAabb,
    pub entries: u32,
    pub cost: f32,
}

impl Shape {
    const EMPTY: Shape = Shape { bounds: ObvhsAabb::INVALID, entries: 0, cost: 0.0 };

    pub fn new(bounds: ObvhsAabb, entries: u32) -> Shape {
        let blocks = entries.div_ceil(TRIANGLE_LANES as u32);
        let cost = bounds.half_area() * (BLOCK_COST * blocks as f32 + ENTRY_COST * entries as f32);
        Shape { bounds, entries, cost }
    }

    /// With another box in it.
    fn with(&self, (bounds, entries): &(ObvhsAabb, u32)) -> Shape {
        Shape::new(self.bounds.union(bounds), self.entries.saturating_add(*entries))
    }
}

/// A leaf of one to eight boxes.
#[derive(Clone, Copy)]
pub(crate) struct Leaf {
    pub shape: Shape,
    /// By their indices, the first `count`.
    boxes: [u32; BOXES],
    count: usize,
}

impl Leaf {
    /// With nothing in it.
    pub const EMPTY: Leaf = Leaf { shape: Shape::EMPTY, boxes: [0; BOXES], count: 0 };

    /// Takes a box, by its index, and how many entries it has.
    pub fn push(&mut self, i: u32, own: &(ObvhsAabb, u32)) {
        self.shape = self.shape.with(own);
        self.boxes[self.count] = i;
        self.count += 1;
    }

    /// The boxes in it, by their indices.
    pub fn boxes(&self) -> impl Iterator<Item = u32> {
        self.boxes[..self.count].iter().copied()
    }
}

/// The leaves of a node.
pub(crate) struct Siblings {
    leaves: [Leaf; WIDTH],
    count: usize,
}

/// How to do without a leaf.
struct Plan {
    gone: usize,
    /// What the others cost more, less what it costs.
    change: f32,
    /// Where its boxes go, in their order.
    to: [usize; TRIANGLE_LANES],
}

impl Siblings {
    /// None yet.
    pub const NONE: Siblings = Siblings { leaves: [Leaf::EMPTY; WIDTH], count: 0 };

    /// Takes one more.
    pub fn push(&mut self, leaf: Leaf) {
        self.leaves[self.count] = leaf;
        self.count += 1;
    }

    /// All of them.
    pub fn leaves(&self) -> &[Leaf] {
        &self.leaves[..self.count]
    }

    /// Does without as many of them as it may. Box i and how many entries it has is `own(i)`.
    pub fn share_out(&mut self, capacity: Capacity, own: impl Fn(u32) -> (ObvhsAabb, u32)) {
        while let Some(plan) = self.plan(capacity, &own) {
            let gone = self.leaves[plan.gone];
            for (i, to) in gone.boxes().zip(plan.to) {
                self.leaves[to].push(i, &own(i));
            }
            self.count -= 1;
            self.leaves[plan.gone] = self.leaves[self.count];
        }
    }

    /// How to do best without one.
    fn plan(&self, capacity: Capacity, own: impl Fn(u32) -> (ObvhsAabb, u32)) -> Option<Plan> {
        let room: u32 = self.leaves().iter().map(|leaf| capacity.room(&leaf.shape)).sum();
        // The room in one that goes is of no use.
        if room < capacity.block {
            return None;
        }
        let mut best: Option<Plan> = None;
        for gone in 0..self.count {
            let leaf = self.leaves[gone].shape;
            if leaf.entries < capacity.block {
                let most =
                    ((MOST - 1.0) * leaf.cost).min(best.as_ref().map_or(f32::INFINITY, |best| best.change));
                best = self.without(gone, capacity, &own, most).or(best);
            }
        }
        best
    }

    /// Has each box of a leaf go where that costs least, if all that changes costs by less than `most`.
    fn without(
        &self,
        gone: usize,
        capacity: Capacity,
        own: impl Fn(u32) -> (ObvhsAabb, u32),
        most: f32,
    ) -> Option<Plan> {
        let mut after: [Shape; WIDTH] = std::array::from_fn(|i| self.leaves[i].shape);
        let mut plan = Plan { gone, change: -after[gone].cost, to: [0; TRIANGLE_LANES] };
        for (i, to) in self.leaves[gone].boxes().zip(&mut plan.to) {
            let one = own(i);
            let mut least: Option<(f32, usize, Shape)> = None;
            for (other, now) in after[..self.count].iter().enumerate() {
                if other != gone && one.1 <= capacity.room(now) {
                    let with = now.with(&one);
                    let more = with.cost - now.cost;
                    if least.is_none_or(|least| more < least.0) {
                        least = Some((more, other, with));
                    }
                }
            }
            // The others never cost less for it.
            let (more, other, with) = least.filter(|_| plan.change < most)?;
            plan.change += more;
            (after[other], *to) = (with, other);
        }
        (plan.change < most).then_some(plan)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::*;

    /// Unit cubes with so much between one and the next; less than nothing where they overlap.
    fn row(count: u32, between: f32) -> Vec<ObvhsAabb> {
        let one = |i: u32| {
            let min = Vec3A::new(i as f32 * (1.0 + between), 0.0, 0.0);
            ObvhsAabb { min, max: min + 1.0 }
        };
        (0..count).map(one).collect()
    }

    /// Leaves of so many boxes, one after the other, once they have shared out.
    fn shared(boxes: &[ObvhsAabb], counts: &[usize], entries: impl Fn(u32) -> u32) -> Vec<Vec<u32>> {
        let own = |i: u32| (boxes[i as usize], entries(i));
        let mut siblings = Siblings::NONE;
        let mut next = 0..boxes.len() as u32;
        for &count in counts {
            let mut leaf = Leaf::EMPTY;
            next.by_ref().take(count).for_each(|i| leaf.push(i, &own(i)));
            siblings.push(leaf);
        }
        siblings.share_out(Capacity::BLOCKS, own);
        for leaf in siblings.leaves() {
            let inside = leaf.boxes().map(|i| boxes[i as usize]).reduce(|a, b| a.union(&b)).unwrap();
            assert_eq!(leaf.shape.bounds, inside);
            assert_eq!(leaf.shape.entries, leaf.boxes().map(&entries).sum::<u32>());
        }
        let mut all: Vec<u32> = siblings.leaves().iter().flat_map(Leaf::boxes).collect();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..boxes.len() as u32), "each box is in one leaf");
        siblings.leaves().iter().map(|leaf| leaf.boxes().collect()).collect()
    }

    #[test]
    fn fewer_leaves_hold_what_lies_together() {
        let counts = |leaves: Vec<Vec<u32>>| {
            let mut counts: Vec<usize> = leaves.iter().map(Vec::len).collect();
            counts.sort_unstable();
            counts
        };
        assert_eq!(counts(shared(&row(12, 0.0), &[3, 2, 3, 4], |_| 1)), [4, 4, 4]);
        // Two blocks have room as well.
        assert_eq!(counts(shared(&row(9, -0.5), &[3, 5, 1], |_| 1)), [3, 6]);
        assert_eq!(counts(shared(&row(8, -0.5), &[5, 3], |_| 1)), [8]);
        // What fits nowhere stays.
        assert_eq!(counts(shared(&row(7, 0.0), &[3, 4], |_| 1)), [3, 4]);
        assert_eq!(counts(shared(&row(8, 0.0), &[4, 4], |_| 1)), [4, 4]);
    }

    #[test]
    fn boxes_go_where_they_cost_least() {
        let leaves = shared(&row(8, 0.0), &[3, 2, 3], |_| 1);
        assert!(leaves.contains(&vec![0, 1, 2, 3]) && leaves.contains(&vec![5, 6, 7, 4]), "{leaves:?}");
    }

    #[test]
    fn what_lies_apart_keeps_its_leaf() {
        let far = |b: &ObvhsAabb| ObvhsAabb { min: b.min + 100.0, max: b.max + 100.0 };
        let (near, far) = (row(2, 0.0), row(2, 0.0).iter().map(far).collect());
        assert_eq!(shared(&[near, far].concat(), &[2, 2], |_| 1), [[0, 1], [2, 3]]);
    }

    #[test]
    fn what_holds_more_than_a_leaf_may_takes_nothing() {
        // Three things where a pile of nine is, which two blocks and a quarter hold.
        let boxes = [row(1, 0.0), row(3, 0.0)].concat();
        let leaves = shared(&boxes, &[1, 1, 1, 1], |i| if i == 0 { 9 } else { 1 });
        assert!(leaves.contains(&vec![0]), "{leaves:?}");
        assert_eq!(leaves.len(), 2);
        // Costs that are no numbers change nothing.
        let huge = |i: u32| ObvhsAabb { min: Vec3A::splat(-1e30), max: Vec3A::splat(1e30 + i as f32 * 1e25) };
        let boxes: Vec<ObvhsAabb> = (0..6).map(huge).collect();
        assert_eq!(shared(&boxes, &[2, 2, 2], |_| 1).len(), 3);
    }
}
