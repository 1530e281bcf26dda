//! A tree with eight children to a node, and the way of single rays through it. It knows boxes
//! alone: what is in its leaves is its users' affair.

use glam::{DVec3, Vec3};

use crate::accel::build::occlusion_order::OcclusionCost;
use crate::accel::bvh::aabb::Aabb;
use crate::accel::bvh::huge_pages::HugePageVec;
use crate::geometry::EPSILON;
use crate::simd::vec3::splat;
use crate::simd::{Lanes, Simd};

/// Children of a node.
pub(crate) const WIDTH: usize = 8;

/// An inner node's index, or a leaf's number with this bit.
pub(crate) const LEAF_BIT: u32 = 1 << 31;

/// The slots of a node in the order in which their children stop rays soonest ([`OcclusionCost`]).
pub(crate) const SLOTS_ASCENDING: [u32; WIDTH] = [0, 1, 2, 3, 4, 5, 6, 7];
/// The last of them first, to be pushed.
pub(crate) const SLOTS_DESCENDING: [u32; WIDTH] = [7, 6, 5, 4, 3, 2, 1, 0];

/// Eight boxes, by axis and then lowest and highest, and what is in them.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub(crate) struct Bvh8Node {
    pub planes: [[[f32; WIDTH]; 2]; 3],
    /// [`LEAF_BIT`] and a leaf's number, or a node's index. The first `count` are there; the boxes of
    /// the others are inside out. What any-hit rays had best ask first comes first.
    pub child: [u32; WIDTH],
    /// Slots in the order in which rays of each octant come to them, the last first, three
    /// bits for each octant: order[i] >> 3·octant & 7 is the slot to be pushed i-th. The lowest
    /// bit of an octant's number is set where x rises along the ray.
    order: [u32; WIDTH],
}

/// The row of the lowest or the highest sides on an axis.
#[inline(always)]
pub(crate) fn plane_row(axis: usize, end: usize) -> usize {
    2 * axis + end
}

/// An order takes the lower 24 bits; the count of children sits above those of the first.
const COUNT_SHIFT: u32 = 24;

impl Bvh8Node {
    pub fn new(children: &[(Aabb, u32)]) -> Bvh8Node {
        let mut node = Bvh8Node {
            planes: [[[f32::MAX; WIDTH], [-f32::MAX; WIDTH]]; 3],
            child: [LEAF_BIT; WIDTH],
            order: [0; WIDTH],
        };
        for (slot, &(bounds, child)) in children.iter().enumerate() {
            node.child[slot] = child;
            node.put(slot, bounds);
        }
        node.sort(children.len());
        node
    }

    /// The box of a child.
    pub fn bounds(&self, slot: usize) -> Aabb {
        let corner = |end: usize| Vec3::from(self.planes.map(|planes| planes[end][slot]));
        Aabb { min: corner(0), max: corner(1) }
    }

    /// Everything by rows of eight: those of a box's sides come first, by [`row`].
    #[inline(always)]
    pub fn rows(&self) -> &[[f32; WIDTH]; 8] {
        bytemuck::cast_ref(self)
    }

    /// Gives a child another box.
    pub fn put(&mut self, slot: usize, bounds: Aabb) {
        for axis in 0..3 {
            self.planes[axis][0][slot] = bounds.min[axis];
            self.planes[axis][1][slot] = bounds.max[axis];
        }
    }

    /// The order of children for each octant: by how far along its diagonal their middles are,
    /// farthest first.
    pub fn sort(&mut self, count: usize) {
        let middle = |axis: usize, slot: usize| {
            // Halves first: the sum of two huge numbers would be infinite.
            0.5 * self.planes[axis][0][slot] + 0.5 * self.planes[axis][1][slot]
        };
        self.order = std::array::from_fn(|i| i as u32 * 0x0024_9249);
        // An octant and its opposite are each other's reverse.
        for octant in 0..4u32 {
            let mut slots: [(f32, u32); WIDTH] = std::array::from_fn(|slot| {
                let along = |axis: usize| {
                    if octant >> axis & 1 == 1 { middle(axis, slot) } else { -middle(axis, slot) }
                };
                (along(0) + along(1) + along(2), slot as u32)
            });
            slots[..count].sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            for i in 0..count {
                let (there, back) = (3 * octant, 3 * (7 - octant));
                self.order[i] = self.order[i] & !(7 << there | 7 << back)
                    | slots[i].1 << there
                    | slots[count - 1 - i].1 << back;
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

    /// Slots in the order of pushing for rays of an octant, in the lowest three bits of each.
    #[inline(always)]
    pub fn order(&self, octant: Octant) -> [u32; WIDTH] {
        let mut order = self.order;
        for slot in &mut order {
            *slot >>= octant.0;
        }
        order
    }
}

/// Three times the number of an octant of directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Octant(u32);

impl Octant {
    #[inline(always)]
    pub fn of(d: Vec3) -> Octant {
        let bit = |x: f32| u32::from(x >= 0.0);
        Octant(3 * (bit(d.x) | bit(d.y) << 1 | bit(d.z) << 2))
    }

    /// That of the directions back.
    #[inline(always)]
    pub fn opposite(self) -> Octant {
        Octant(21 - self.0)
    }
}

/// A tree over boxes.
#[derive(Debug)]
pub(crate) struct Bvh8 {
    /// Parents before their children.
    pub nodes: HugePageVec<Bvh8Node>,
    /// What a ray begins with; `None` for an empty tree.
    pub root: Option<u32>,
    /// Around everything.
    pub bounds: Aabb,
    /// Of everything, when it was built.
    pub odds: OcclusionCost,
}

impl Default for Bvh8 {
    fn default() -> Self {
        Bvh8 {
            nodes: HugePageVec::default(),
            root: None,
            bounds: Aabb::EMPTY,
            odds: OcclusionCost::default(),
        }
    }
}

impl Bvh8 {
    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.nodes.bytes()
    }
}

/// What a ray has yet to visit, with where it enters it. One for each batch, reused ray after ray.
#[derive(Clone, Debug)]
pub(crate) struct TraversalStack {
    child: Vec<u32>,
    near: Vec<f32>,
    /// Entries in use.
    top: usize,
}

impl Default for TraversalStack {
    fn default() -> Self {
        TraversalStack { child: vec![0; 256], near: vec![0.0; 256], top: 0 }
    }
}

impl TraversalStack {
    /// Room for eight more from `top` on.
    #[inline(always)]
    fn room(&mut self, top: usize) -> (&mut [f32; WIDTH], &mut [u32; WIDTH]) {
        if top + WIDTH > self.child.len() {
            self.grow(top);
        }
        let range = top..top + WIDTH;
        // As long as that always: it cannot fail.
        let near = self.near[range.clone()].first_chunk_mut();
        let child = self.child[range].first_chunk_mut();
        match (near, child) {
            (Some(near), Some(child)) => (near, child),
            _ => unreachable!("ranges have their length"),
        }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, top: usize) {
        let size = 2 * (top + WIDTH);
        self.child.resize(size, 0);
        self.near.resize(size, 0.0);
    }
}

/// What happens at leaves.
pub(crate) trait Leaves<S: Simd> {
    /// The ray enters the box of leaf `leaf`. The limit from there on, or `None` to stop.
    fn enter(&mut self, leaf: u32, stack: &mut TraversalStack) -> Option<f32>;
}

impl Bvh8 {
    /// Leads a ray through what is under `from`, near children first. Leaves are entered no
    /// farther than `limit`. False where it was stopped.
    #[inline(always)]
    pub fn walk<S: Simd>(
        &self,
        from: u32,
        ray: &BoxTestRay,
        stack: &mut TraversalStack,
        mut limit: f32,
        leaves: &mut impl Leaves<S>,
    ) -> bool {
        // Kept here, not in memory: every step waits for it.
        let base = stack.top;
        let mut top = base;
        let slabs: Slabs<S> = Slabs::new(ray);
        let nodes: &[Bvh8Node] = &self.nodes;
        let mut here = from;
        loop {
            if here & LEAF_BIT == 0 {
                let node = &nodes[here as usize];
                let orders = [node.order(ray.octant), node.order(ray.octant.opposite())];
                let meets = slabs.meets(node, limit);
                let (near, child) = stack.room(top);
                let hit = S::compress_intersected(meets.0, meets.1, orders, &node.child, near, child);
                if hit.count > 0 {
                    top += hit.count - 1;
                    here = hit.last;
                    continue;
                }
            } else {
                stack.top = top;
                match leaves.enter(here & !LEAF_BIT, stack) {
                    Some(to) => limit = to,
                    None => {
                        stack.top = base;
                        return false;
                    }
                }
            }
            loop {
                stack.top = base;
                if top == base {
                    return true;
                }
                top -= 1;
                let (Some(&next), Some(&near)) = (stack.child.get(top), stack.near.get(top)) else {
                    return true;
                };
                if near <= limit {
                    here = next;
                    break;
                }
            }
        }
    }

    /// [`Bvh8::walk`] for a ray that asks for any hit up to `limit`: it goes by the children's odds, whose
    /// order is that of the slots.
    #[inline(always)]
    pub fn walk_any<S: Simd>(
        &self,
        from: u32,
        ray: &BoxTestRay,
        stack: &mut TraversalStack,
        limit: f32,
        leaves: &mut impl Leaves<S>,
    ) -> bool {
        let base = stack.top;
        let mut top = base;
        let slabs: Slabs<S> = Slabs::new(ray);
        let nodes: &[Bvh8Node] = &self.nodes;
        let mut here = from;
        loop {
            if here & LEAF_BIT == 0 {
                let node = &nodes[here as usize];
                let (enters, leaves) = slabs.meets(node, limit);
                let met = enters.le(leaves);
                if met != 0 {
                    // A node and the slots that are left of it, not its children one by one.
                    let ((_, room), left) = (stack.room(top), met & (met - 1));
                    (room[0], room[1]) = (here, left);
                    top += if left == 0 { 0 } else { 2 };
                    here = node.child[met.trailing_zeros() as usize & (WIDTH - 1)];
                    continue;
                }
            } else {
                stack.top = top;
                let goes_on = leaves.enter(here & !LEAF_BIT, stack).is_some();
                stack.top = base;
                if !goes_on {
                    return false;
                }
            }
            if top == base {
                return true;
            }
            let Some([node, left]) = stack.child[..top].last_chunk_mut() else { return true };
            here = nodes[*node as usize].child[left.trailing_zeros() as usize & (WIDTH - 1)];
            *left &= *left - 1;
            top -= if *left == 0 { 2 } else { 0 };
        }
    }
}

/// A ray and eight boxes at once.
struct Slabs<S: Simd> {
    near: ([S::F32x8; 3], [S::F32x8; 3]),
    far: ([S::F32x8; 3], [S::F32x8; 3]),
    start: S::F32x8,
    /// For each axis which end of a box is met first.
    near_end: [usize; 3],
}

impl<S: Simd> Slabs<S> {
    #[inline(always)]
    fn new(ray: &BoxTestRay) -> Self {
        Slabs {
            near: (splat(ray.near_scale), splat(ray.near_shift)),
            far: (splat(ray.far_scale), splat(ray.far_shift)),
            start: S::F32x8::splat(ray.start),
            near_end: ray.near_end,
        }
    }

    /// Where the ray enters a node's boxes, and where it leaves them or is at its end.
    #[inline(always)]
    fn meets(&self, node: &Bvh8Node, limit: f32) -> (S::F32x8, S::F32x8) {
        let side = |axis: usize, end: usize, (scale, shift): ([S::F32x8; 3], [S::F32x8; 3])| {
            S::F32x8::load(&node.planes[axis][end]).mul_sub(scale[axis], shift[axis])
        };
        let near = |axis: usize| side(axis, self.near_end[axis], self.near);
        let far = |axis: usize| side(axis, 1 - self.near_end[axis], self.far);
        // NaN comes of infinity minus infinity, and says nothing: the other side decides.
        (
            near(0).max(near(1).max(near(2).max(self.start))),
            far(0).min(far(1).min(far(2).min(S::F32x8::splat(limit)))),
        )
    }
}

/// A ray prepared for boxes.
///
/// A plane b is met at b/d − o/d, fused. The near sides get shifts and scales that can only bring
/// them nearer, the far sides such that can only take them farther, by more than roundings can do
/// in the other direction: those of o, d, 1/d and the results are each relative to their numbers,
/// and make 4ε at most of o/d and of t. So the test is conservative wherever the ray comes from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxTestRay {
    near_scale: Vec3,
    near_shift: Vec3,
    far_scale: Vec3,
    far_shift: Vec3,
    /// For each axis which end of a box is met first.
    near_end: [usize; 3],
    octant: Octant,
    /// Boxes that end before this are behind the ray.
    start: f32,
}

/// Relative slack of what is far.
pub(crate) const FAR_FACTOR: f32 = 1.0 + 8.0 * EPSILON;
/// Relative slack of what is near.
pub(crate) const NEAR_FACTOR: f32 = 1.0 - 8.0 * EPSILON;

/// A component of a direction that is less than this counts as this: its reciprocal is finite.
pub(crate) const MIN_DIRECTION: f32 = 1e-30;

/// The most that o/d may be.
const MOST_SHIFT: f32 = 1e37;

/// The reciprocals of a direction's components.
#[inline(always)]
pub(crate) fn direction_reciprocal(d: Vec3) -> Vec3 {
    let one = |x: f32| 1.0 / if x.abs() < MIN_DIRECTION { MIN_DIRECTION.copysign(x) } else { x };
    Vec3::new(one(d.x), one(d.y), one(d.z))
}

impl BoxTestRay {
    /// Boxes count as wider by `pad` on every side.
    #[inline(always)]
    pub fn new(o: DVec3, d: DVec3, pad: f32, start: f32) -> BoxTestRay {
        let (o, d) = (o.as_vec3(), d.as_vec3());
        // Not so large that o/d were infinite: a fused b/d − o/d would be, too, on the wrong side.
        let r = direction_reciprocal(d).clamp(-MOST_SHIFT / o.abs(), MOST_SHIFT / o.abs());
        let (near_scale, far_scale) = (r * (1.0 - 4.0 * EPSILON), r * (1.0 + 4.0 * EPSILON));
        let slack = (4.0 * EPSILON * o.abs() + pad) * r.abs();
        BoxTestRay {
            near_scale,
            near_shift: o * near_scale + slack,
            far_scale,
            far_shift: o * far_scale - slack,
            near_end: [usize::from(r.x < 0.0), usize::from(r.y < 0.0), usize::from(r.z < 0.0)],
            octant: Octant::of(d),
            start: start * NEAR_FACTOR,
        }
    }

    /// The limit for a t, with slack for the rounding of the boxes' near sides.
    #[inline(always)]
    pub fn limit(t: f32) -> f32 {
        t * FAR_FACTOR
    }
}
