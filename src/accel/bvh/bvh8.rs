//! Eight-wide BVH (BVH8): a node holds the boxes of eight children side by side, for one SIMD box test.
//!
//! The tree knows boxes only. A leaf is a number, whose meaning the BLAS and the TLAS define.

use glam::Vec3;

use crate::bvh::aabb::Aabb;
use crate::bvh::huge_pages::HugePageArray;
use crate::bvh::occlusion_order::OcclusionCost;

/// Children of a node.
pub(crate) const WIDTH: usize = 8;

/// Boxes of unused slots reach from this to its negative, so that no ray enters them. It is beyond all coordinates, but
/// its reciprocal is a normal number: subnormal ones are slow on many processors.
const EMPTY_SLOT: f32 = (1u128 << 125) as f32;

/// Marks a child reference as a leaf number; without it, a reference is a node's index.
pub(crate) const LEAF_BIT: u32 = 1 << 31;

/// The slots of a node from first to last: descending priority for shadow rays ([`OcclusionCost::priority`]).
pub(crate) const SLOTS_IN_ORDER: [u32; WIDTH] = [0, 1, 2, 3, 4, 5, 6, 7];
/// The same in the order of pushing to a stack.
pub(crate) const SLOTS_REVERSED: [u32; WIDTH] = [7, 6, 5, 4, 3, 2, 1, 0];

/// An inner node: the boxes of up to eight children and references to them.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Bvh8Node {
    /// The planes of the boxes, by axis, side (min, max) and child.
    pub planes: [[[f32; WIDTH]; 2]; 3],
    /// [`LEAF_BIT`] and a leaf's number, or a node's index. The first [`Bvh8Node::count`] are used; the boxes
    /// of the others are empty. Children are sorted by descending priority for shadow rays.
    pub child: [u32; WIDTH],
    /// Front-to-back order of the slots for each octant of ray directions, farthest first, in three bits
    /// for each octant: `order[i] >> 3·octant & 7` is the slot to be pushed i-th. The lowest bit of an octant's
    /// number is set where x grows along the ray.
    order: [u32; WIDTH],
}

/// The row of [`Bvh8Node::rows`] with the min (0) or max (1) planes of an axis.
#[inline(always)]
pub(crate) fn plane_row(axis: usize, side: usize) -> usize {
    2 * axis + side
}

/// The orders of eight octants take the lower 24 bits; the first word holds the child count above them.
const COUNT_SHIFT: u32 = 24;

impl Bvh8Node {
    /// Builds a node from the boxes and references of 1 to 8 children.
    pub fn new(children: &[(Aabb, u32)]) -> Bvh8Node {
        let mut node = Bvh8Node {
            planes: [[[EMPTY_SLOT; WIDTH], [-EMPTY_SLOT; WIDTH]]; 3],
            child: [LEAF_BIT; WIDTH],
            order: [0; WIDTH],
        };
        for (slot, &(bounds, child)) in children.iter().enumerate() {
            node.child[slot] = child;
            node.set_bounds(slot, bounds);
        }
        node.update_order(children.len());
        node
    }

    /// The box of a child.
    pub fn bounds(&self, slot: usize) -> Aabb {
        let corner = |side: usize| Vec3::from(self.planes.map(|planes| planes[side][slot]));
        Aabb { min: corner(0), max: corner(1) }
    }

    /// The box around all children.
    pub fn union_of_children(&self) -> Aabb {
        Aabb::union_of((0..self.count()).map(|slot| self.bounds(slot)))
    }

    /// All data as rows of eight: first the box planes, indexed by [`plane_row`].
    #[inline(always)]
    pub fn rows(&self) -> &[[f32; WIDTH]; 8] {
        bytemuck::cast_ref(self)
    }

    /// Replaces the box of a child. Call [`Bvh8Node::update_order`] after the last one.
    pub fn set_bounds(&mut self, slot: usize, bounds: Aabb) {
        for axis in 0..3 {
            self.planes[axis][0][slot] = bounds.min[axis];
            self.planes[axis][1][slot] = bounds.max[axis];
        }
    }

    /// Sorts the first `count` children front to back for each octant: by their centres' distances along
    /// the octant's diagonal.
    pub fn update_order(&mut self, count: usize) {
        let centre = |axis: usize, slot: usize| {
            // Halve first: the sum of two huge numbers would be infinite.
            0.5 * self.planes[axis][0][slot] + 0.5 * self.planes[axis][1][slot]
        };
        // Slot i in place i for all octants: a bit at the lowest of each octant's three.
        const EVERY_OCTANT: u32 = 0o11_111_111;
        self.order = std::array::from_fn(|i| i as u32 * EVERY_OCTANT);
        // The order of an octant is the reverse of its opposite's.
        for octant in 0..4u32 {
            let mut slots: [(f32, u32); WIDTH] = std::array::from_fn(|slot| {
                let along = |axis: usize| {
                    if octant >> axis & 1 == 1 { centre(axis, slot) } else { -centre(axis, slot) }
                };
                (along(0) + along(1) + along(2), slot as u32)
            });
            slots[..count].sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for i in 0..count {
                let shift = 3 * octant;
                let opposite_shift = 3 * (7 - octant);
                self.order[i] = self.order[i] & !(7 << shift | 7 << opposite_shift)
                    | slots[i].1 << shift
                    | slots[count - 1 - i].1 << opposite_shift;
            }
        }
        self.order[0] |= (count as u32) << COUNT_SHIFT;
    }

    /// Number of children.
    #[inline(always)]
    pub fn count(&self) -> usize {
        (self.order[0] >> COUNT_SHIFT) as usize
    }

    /// A bit for each child.
    #[inline(always)]
    pub fn child_mask(&self) -> u32 {
        (1 << self.count()) - 1
    }

    /// The slot to be pushed `nth` for an octant.
    #[inline(always)]
    pub fn nth_slot(&self, octant: Octant, nth: usize) -> usize {
        (self.order[nth] >> octant.0) as usize & (WIDTH - 1)
    }

    /// Slots in the order of pushing (farthest first) for an octant, in the lowest three bits of each word.
    #[inline(always)]
    pub fn order(&self, octant: Octant) -> [u32; WIDTH] {
        let mut order = self.order;
        for slot in &mut order {
            *slot >>= octant.0;
        }
        order
    }
}

/// Number of octants.
pub(crate) const OCTANTS: usize = 8;

/// An octant of ray directions. It holds three times the octant's number, the shift of its bits in [`Bvh8Node::order`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Octant(u32);

impl Octant {
    /// The octant of a direction.
    #[inline(always)]
    pub fn of(d: Vec3) -> Octant {
        let bit = |x: f32| u32::from(x >= 0.0);
        Octant(3 * (bit(d.x) | bit(d.y) << 1 | bit(d.z) << 2))
    }

    /// The octant of a number below eight, whose lowest bit is set where x grows along the ray.
    #[inline(always)]
    pub fn from_number(number: usize) -> Octant {
        Octant(3 * (number as u32 & 7))
    }

    /// The octant of the negated direction.
    #[inline(always)]
    pub fn opposite(self) -> Octant {
        Octant(21 - self.0)
    }
}

/// An eight-wide BVH.
#[derive(Debug, Default)]
pub(crate) struct Bvh8 {
    /// Parents before their children.
    pub nodes: HugePageArray<Bvh8Node>,
    /// Reference to the root, a node or a leaf; `None` for an empty tree.
    pub root: Option<u32>,
    /// Bounds of everything.
    pub bounds: Aabb,
    /// Occlusion cost of the whole tree at the time of its build.
    pub occlusion_cost: OcclusionCost,
}

impl Bvh8 {
    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.nodes.bytes()
    }
}
