//! Ray–box test: one ray against the eight child boxes of a BVH node, by the slab method.

use glam::{DVec3, Vec3};

use crate::bvh::bvh8::{Bvh8Node, Octant, WIDTH};
use blinn_core::geometry::EPSILON;
use blinn_core::simd::vec3::splat;
use blinn_core::simd::{Lanes, Simd};

/// Rounding slack of exit distances: multiply by it to enlarge.
pub(crate) const FAR_FACTOR: f32 = 1.0 + 8.0 * EPSILON;
/// Rounding slack of entry distances: multiply by it to shrink.
pub(crate) const NEAR_FACTOR: f32 = 1.0 - 8.0 * EPSILON;

/// Direction components smaller than this are replaced by it, so that their reciprocals are finite.
pub(crate) const MIN_DIRECTION: f32 = 1e-30;

/// Maximum of o/d that a [`BoxTestRay`] works with.
pub(crate) const MAX_SHIFT: f32 = 1e37;

/// Returns 1/d by component, finite also where d is zero.
#[inline(always)]
pub(crate) fn direction_reciprocal(d: Vec3) -> Vec3 {
    let one = |x: f32| 1.0 / if x.abs() < MIN_DIRECTION { MIN_DIRECTION.copysign(x) } else { x };
    Vec3::new(one(d.x), one(d.y), one(d.z))
}

/// A ray prepared for box tests.
///
/// The plane b is hit at t = b/d − o/d, by a fused multiply–subtract. Near planes are only ever moved nearer, far planes
/// only farther, by more than rounding can do in the other direction: the errors of o, d, 1/d and the results are each
/// relative, and sum to 4ε at most of o/d and of t. So the test is conservative wherever the ray starts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoxTestRay {
    near_scale: Vec3,
    near_shift: Vec3,
    far_scale: Vec3,
    far_shift: Vec3,
    /// The side of boxes that the ray enters by, for each axis: 0 for min, 1 for max.
    near_side: [usize; 3],
    octant: Octant,
    /// Boxes that end before this are behind the ray.
    t_min: f32,
}

impl BoxTestRay {
    /// Prepares a ray for boxes that count as larger by `padding` on every side.
    #[inline(always)]
    pub fn new(o: DVec3, d: DVec3, padding: f32, t_min: f32) -> BoxTestRay {
        let o = o.as_vec3();
        let d = d.as_vec3();
        // Keep o/d finite: a fused b/d − o/d would be infinite with the wrong sign.
        let r = direction_reciprocal(d).clamp(-MAX_SHIFT / o.abs(), MAX_SHIFT / o.abs());
        let near_scale = r * (1.0 - 4.0 * EPSILON);
        let far_scale = r * (1.0 + 4.0 * EPSILON);
        let slack = (4.0 * EPSILON * o.abs() + padding) * r.abs();
        BoxTestRay {
            near_scale,
            near_shift: o * near_scale + slack,
            far_scale,
            far_shift: o * far_scale - slack,
            near_side: [usize::from(r.x < 0.0), usize::from(r.y < 0.0), usize::from(r.z < 0.0)],
            octant: Octant::of(d),
            t_min: t_min * NEAR_FACTOR,
        }
    }

    /// Returns the limit on entry distances for hits up to `t`, with slack for the rounding of near planes.
    #[inline(always)]
    pub fn limit(t: f32) -> f32 {
        t * FAR_FACTOR
    }
}

/// Tests a ray against the children of nodes, for closest-hit traversal.
pub(crate) trait OrderedNodeTest {
    /// Writes the children that the ray enters before `limit`, farthest first, with their entry distances, and
    /// returns how many there are and the last one, the nearest.
    fn sort_hit_children(
        &self,
        node: &Bvh8Node,
        limit: f32,
        near: &mut [f32; WIDTH],
        child: &mut [u32; WIDTH],
    ) -> (usize, u32);
}

/// Tests a ray or a frustum against the children of nodes, for any-hit traversal.
pub(crate) trait NodeTest {
    /// Returns a bit for each child that the ray enters before `limit`.
    fn hit_mask(&self, node: &Bvh8Node, limit: f32) -> u32;
}

/// The slabs of a [`BoxTestRay`] in SIMD lanes, one for each child.
pub(crate) struct SimdNodeTest<S: Simd> {
    near: Slabs<S>,
    far: Slabs<S>,
    t_min: S::F32x8,
    near_side: [usize; 3],
    octant: Octant,
}

/// Plane b of an axis is hit at `b · scale − shift`.
struct Slabs<S: Simd> {
    scale: [S::F32x8; 3],
    shift: [S::F32x8; 3],
}

impl<S: Simd> Slabs<S> {
    #[inline(always)]
    fn distance(&self, node: &Bvh8Node, axis: usize, side: usize) -> S::F32x8 {
        S::F32x8::load(&node.planes[axis][side]).mul_sub(self.scale[axis], self.shift[axis])
    }
}

impl<S: Simd> SimdNodeTest<S> {
    #[inline(always)]
    pub fn new(ray: &BoxTestRay) -> Self {
        SimdNodeTest {
            near: Slabs { scale: splat(ray.near_scale), shift: splat(ray.near_shift) },
            far: Slabs { scale: splat(ray.far_scale), shift: splat(ray.far_shift) },
            t_min: S::F32x8::splat(ray.t_min),
            near_side: ray.near_side,
            octant: ray.octant,
        }
    }

    /// Returns where the ray enters each child box and where it leaves it or reaches `limit`.
    #[inline(always)]
    fn intervals(&self, node: &Bvh8Node, limit: f32) -> (S::F32x8, S::F32x8) {
        let near = |axis: usize| self.near.distance(node, axis, self.near_side[axis]);
        let far = |axis: usize| self.far.distance(node, axis, 1 - self.near_side[axis]);
        // Infinity minus infinity is NaN, which min and max drop: the other planes decide.
        (
            near(0).max(near(1).max(near(2).max(self.t_min))),
            far(0).min(far(1).min(far(2).min(S::F32x8::splat(limit)))),
        )
    }
}

impl<S: Simd> OrderedNodeTest for SimdNodeTest<S> {
    #[inline(always)]
    fn sort_hit_children(
        &self,
        node: &Bvh8Node,
        limit: f32,
        near: &mut [f32; WIDTH],
        child: &mut [u32; WIDTH],
    ) -> (usize, u32) {
        let orders = [node.order(self.octant), node.order(self.octant.opposite())];
        let (enter, exit) = self.intervals(node, limit);
        let hit = S::compress_intersected(enter, exit, orders, &node.child, near, child);
        (hit.count, hit.last)
    }
}

impl<S: Simd> NodeTest for SimdNodeTest<S> {
    #[inline(always)]
    fn hit_mask(&self, node: &Bvh8Node, limit: f32) -> u32 {
        let (enter, exit) = self.intervals(node, limit);
        enter.le(exit)
    }
}
