//! Leaf packing: repacks the boxes of a wide node's leaves by the surface area heuristic (SAH), so that fewer blocks hold
//! them.
//!
//! The leaves of a binary tree are as full as its branches happen to be: hardly more than three of four lanes of a
//! block are used. But blocks are most of a BVH's memory, and which leaf of a wide node holds a triangle
//! matters little to rays.

use obvhs::aabb::Aabb as ObvhsAabb;

use crate::bvh::bvh8::WIDTH;
use crate::bvh::triangle4::TRIANGLE_LANES;

/// Leaf cost for each block and for each entry, where visiting a node of the same bounds costs 1.
const BLOCK_COST: f32 = 0.6;
const ENTRY_COST: f32 = 0.2;

/// A leaf is dissolved where its boxes cost the other leaves at most this multiple of its own cost.
const MAX_COST_RATIO: f32 = 2.5;

/// Maximum number of boxes in a leaf.
const MAX_BOXES: usize = 2 * TRIANGLE_LANES;

/// How many entries fit into a block, whose entries are tested at once (a power of two up to 4), and into a leaf
/// (up to 8). A box that has more than a leaf's capacity is a leaf of its own.
#[derive(Clone, Copy)]
pub(crate) struct LeafCapacity {
    pub entries_per_block: u32,
    pub entries_per_leaf: u32,
}

impl LeafCapacity {
    /// One entry in each leaf.
    pub const ONE: LeafCapacity = LeafCapacity { entries_per_block: 1, entries_per_leaf: 1 };
    /// One or two blocks of four triangles in each leaf.
    pub const BLOCKS: LeafCapacity =
        LeafCapacity { entries_per_block: TRIANGLE_LANES as u32, entries_per_leaf: MAX_BOXES as u32 };

    /// Number of entries that a leaf can take without another block.
    fn room(self, leaf: &LeafShape) -> u32 {
        if leaf.entries > self.entries_per_leaf {
            0
        } else {
            leaf.entries.wrapping_neg() & (self.entries_per_block - 1)
        }
    }
}

/// A box and the number of entries in it.
#[derive(Clone, Copy)]
pub(crate) struct EntryBox {
    pub bounds: ObvhsAabb,
    pub entries: u32,
}

/// The bounds, size and cost of a leaf.
#[derive(Clone, Copy)]
pub(crate) struct LeafShape {
    pub bounds: ObvhsAabb,
    pub entries: u32,
    /// SAH cost: the cost of a visit times the half area of the bounds.
    pub cost: f32,
}

impl LeafShape {
    const EMPTY: LeafShape = LeafShape { bounds: ObvhsAabb::INVALID, entries: 0, cost: 0.0 };

    #[inline(always)]
    pub fn new(bounds: ObvhsAabb, entries: u32) -> LeafShape {
        let blocks = entries.div_ceil(TRIANGLE_LANES as u32);
        let cost = bounds.half_area() * (BLOCK_COST * blocks as f32 + ENTRY_COST * entries as f32);
        LeafShape { bounds, entries, cost }
    }

    /// The shape with another box added.
    fn with(&self, added: &EntryBox) -> LeafShape {
        LeafShape::new(self.bounds.union(&added.bounds), self.entries.saturating_add(added.entries))
    }
}

/// A leaf of one to eight boxes.
#[derive(Clone, Copy)]
pub(crate) struct Leaf {
    pub shape: LeafShape,
    /// Indices of the boxes, the first `count`.
    boxes: [u32; MAX_BOXES],
    count: usize,
}

impl Leaf {
    const EMPTY: Leaf = Leaf::new(LeafShape::EMPTY);

    /// Makes a leaf that has its shape, but no boxes yet.
    pub const fn new(shape: LeafShape) -> Leaf {
        Leaf { shape, boxes: [0; MAX_BOXES], count: 0 }
    }

    /// Adds boxes that the shape has already.
    pub fn extend(&mut self, boxes: &[u32]) {
        self.boxes[self.count..][..boxes.len()].copy_from_slice(boxes);
        self.count += boxes.len();
    }

    /// Adds box `i`.
    pub fn push(&mut self, i: u32, entry_box: &EntryBox) {
        self.shape = self.shape.with(entry_box);
        self.boxes[self.count] = i;
        self.count += 1;
    }

    /// The indices of the boxes.
    pub fn boxes(&self) -> impl Iterator<Item = u32> {
        self.boxes[..self.count].iter().copied()
    }
}

/// The leaves of a wide node.
pub(crate) struct SiblingLeaves {
    leaves: [Leaf; WIDTH],
    count: usize,
}

/// A way to dissolve a leaf.
struct Removal {
    removed: usize,
    /// Additional cost of the other leaves, less the leaf's own.
    cost_change: f32,
    /// The leaves that take its boxes, in their order.
    targets: [usize; TRIANGLE_LANES],
}

/// The cheapest leaf for a box.
struct Target {
    leaf: usize,
    cost_increase: f32,
    shape: LeafShape,
}

impl Default for SiblingLeaves {
    fn default() -> Self {
        SiblingLeaves { leaves: [Leaf::EMPTY; WIDTH], count: 0 }
    }
}

impl SiblingLeaves {
    /// Removes all leaves.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a leaf.
    pub fn push(&mut self, leaf: Leaf) {
        self.leaves[self.count] = leaf;
        self.count += 1;
    }

    /// All leaves.
    pub fn leaves(&self) -> &[Leaf] {
        &self.leaves[..self.count]
    }

    /// Dissolves leaves into the free lanes of others, the best first, as long as that pays. `entry_box` returns
    /// box i.
    pub fn repack(&mut self, capacity: LeafCapacity, entry_box: impl Fn(u32) -> EntryBox) {
        while let Some(removal) = self.best_removal(capacity, &entry_box) {
            let removed = self.leaves[removal.removed];
            for (i, target) in removed.boxes().zip(removal.targets) {
                self.leaves[target].push(i, &entry_box(i));
            }
            self.count -= 1;
            self.leaves[removal.removed] = self.leaves[self.count];
        }
    }

    /// Finds the removal with the least cost.
    fn best_removal(&self, capacity: LeafCapacity, entry_box: impl Fn(u32) -> EntryBox) -> Option<Removal> {
        let room: u32 = self.leaves().iter().map(|leaf| capacity.room(&leaf.shape)).sum();
        // The room of the removed leaf does not count.
        if room < capacity.entries_per_block {
            return None;
        }
        let mut best: Option<Removal> = None;
        for removed in 0..self.count {
            let leaf = self.leaves[removed].shape;
            if leaf.entries < capacity.entries_per_block {
                let best_so_far = best.as_ref().map_or(f32::INFINITY, |best| best.cost_change);
                let max_cost = ((MAX_COST_RATIO - 1.0) * leaf.cost).min(best_so_far);
                best = self.removal(removed, capacity, &entry_box, max_cost).or(best);
            }
        }
        best
    }

    /// Moves each box of a leaf to where it costs least; `None` where that changes the cost by `max_cost` or more.
    fn removal(
        &self,
        removed: usize,
        capacity: LeafCapacity,
        entry_box: impl Fn(u32) -> EntryBox,
        max_cost: f32,
    ) -> Option<Removal> {
        let mut shapes: [LeafShape; WIDTH] = std::array::from_fn(|i| self.leaves[i].shape);
        let mut removal =
            Removal { removed, cost_change: -shapes[removed].cost, targets: [0; TRIANGLE_LANES] };
        for (i, target) in self.leaves[removed].boxes().zip(&mut removal.targets) {
            let moved = entry_box(i);
            // An Option would be compared before it is tested, which meets subnormal numbers where it is not set.
            let mut cheapest = Target { leaf: removed, cost_increase: f32::INFINITY, shape: shapes[removed] };
            for (leaf, now) in shapes[..self.count].iter().enumerate() {
                if leaf != removed && moved.entries <= capacity.room(now) {
                    let shape = now.with(&moved);
                    let cost_increase = shape.cost - now.cost;
                    if cost_increase < cheapest.cost_increase {
                        cheapest = Target { leaf, cost_increase, shape };
                    }
                }
            }
            // Costs only grow: there is no way back below the maximum.
            if cheapest.leaf == removed || !(removal.cost_change < max_cost) {
                return None;
            }
            removal.cost_change += cheapest.cost_increase;
            shapes[cheapest.leaf] = cheapest.shape;
            *target = cheapest.leaf;
        }
        (removal.cost_change < max_cost).then_some(removal)
    }
}

#[cfg(test)]
mod tests;
