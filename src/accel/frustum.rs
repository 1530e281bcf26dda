//! Frustum culling: may any ray between four corner rays intersect a triangle? Tiles of pixels without any are
//! skipped.

#[cfg(test)]
mod tests;

use std::marker::PhantomData;

use glam::{DVec3, Vec3};

use crate::bvh::bvh8::{Bvh8, Bvh8Node, WIDTH, plane_row};
use crate::bvh::scene_bvh::SceneBvh;
use crate::traverse::box_test::NodeTest;
use crate::traverse::bvh8_traversal::{LeafVisitor, TraversalStack};
use blinn_core::geometry::Ray;
use blinn_core::simd::vec3::per_axis;
use blinn_core::simd::{Lanes, Simd, SimdKernel};

/// The side planes of a frustum between four rays that share an origin or a direction.
struct Frustum([Plane; 4]);

/// A plane whose inner side has n·p ≥ offset.
#[derive(Clone, Copy)]
struct Plane {
    /// Unit normal, NaN where two corner rays span no plane.
    n: DVec3,
    offset: f64,
    /// The sum of the magnitudes whose sum is `offset`.
    offset_magnitude: f64,
}

/// Boxes are enlarged by this fraction of the BVH's coordinates and the origin's: far more than f32 rays and the boxes
/// of BVHs are off by.
const SLACK: f64 = 1e-5;

/// [`Accel::may_intersect`] at a SIMD level.
///
/// [`Accel::may_intersect`]: crate::Accel::may_intersect
pub(crate) struct FrustumKernel<'a> {
    pub bvh: &'a SceneBvh,
    pub corner_rays: &'a [Ray; 4],
}

impl SimdKernel for FrustumKernel<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self) -> bool {
        let FrustumKernel { bvh, corner_rays } = self;
        let frustum = Frustum::new(corner_rays);
        let tlas = &bvh.tlas;
        let padding =
            || corner_rays.iter().fold(0f32, |padding, ray| padding.max(tlas.padding(ray.o.as_dvec3())));
        bvh.worlds().iter().any(|world| frustum.may_intersect::<S>(&world.bvh, 0.0))
            || (!tlas.is_empty() && frustum.may_intersect::<S>(&tlas.bvh, f64::from(padding())))
    }
}

/// A plane in the form that the boxes of nodes are tested with.
struct PlaneTest {
    /// For each axis the row of [`Bvh8Node::rows`] with the sides of boxes that are innermost.
    ///
    /// [`Bvh8Node::rows`]: crate::bvh::bvh8::Bvh8Node::rows
    rows: [usize; 3],
    n: Vec3,
    /// Boxes are outside where n·p of their innermost corner is less than this.
    min: f32,
}

impl Frustum {
    #[inline(always)]
    fn new(corner_rays: &[Ray; 4]) -> Frustum {
        let rays = corner_rays.map(|ray| (ray.o.as_dvec3(), ray.d.as_dvec3()));
        let inner = rays.iter().map(|(o, d)| (*o + *d) * 0.25).sum::<DVec3>();
        Frustum(std::array::from_fn(|i| {
            let (o, d) = rays[i];
            let (next_o, next_d) = rays[(i + 1) % 4];
            let n = d.cross(next_o + next_d - o);
            let n = if n.dot(inner - o) < 0.0 { -n } else { n };
            let n = n / n.length();
            Plane { n, offset: n.dot(o), offset_magnitude: n.abs().dot(o.abs()) }
        }))
    }

    /// Returns false if the frustum certainly intersects no leaf box of a BVH, whose boxes are enlarged by
    /// `padding`.
    #[inline(always)]
    fn may_intersect<S: Simd>(&self, bvh: &Bvh8, padding: f64) -> bool {
        let Some(root) = bvh.root else { return false };
        let max_coordinates = bvh.bounds.min.abs().max(bvh.bounds.max.abs()).as_dvec3() + padding;
        let planes = self.0.map(|plane| {
            let abs_n = plane.n.abs();
            let slack = SLACK * (abs_n.dot(max_coordinates) + plane.offset_magnitude);
            PlaneTest {
                rows: per_axis(|axis| plane_row(axis, usize::from(plane.n[axis] > 0.0))),
                n: plane.n.as_vec3(),
                min: (plane.offset - padding * abs_n.element_sum() - slack) as f32,
            }
        });
        let test = FrustumTest::<S> { planes, simd: PhantomData };
        let mut stack = TraversalStack::default();
        !bvh.traverse_any(root, &test, &mut stack, f32::INFINITY, &mut StopAtLeaf)
    }
}

/// Tests the boxes of nodes against a frustum.
struct FrustumTest<S> {
    planes: [PlaneTest; 4],
    simd: PhantomData<S>,
}

impl<S: Simd> NodeTest for FrustumTest<S> {
    #[inline(always)]
    fn hit_mask(&self, node: &Bvh8Node, _: f32) -> u32 {
        let mut inside = node.child_mask();
        for plane in &self.planes {
            inside &= !plane.outside_children::<S>(node.rows());
        }
        inside
    }
}

/// Ends a traversal at the first leaf.
struct StopAtLeaf;

impl LeafVisitor for StopAtLeaf {
    #[inline(always)]
    fn visit_leaf(&mut self, _: u32, _: &mut TraversalStack) -> Option<f32> {
        None
    }
}

impl PlaneTest {
    /// Returns a bit for each child whose box is certainly outside of the plane. NaN is not.
    #[inline(always)]
    fn outside_children<S: Simd>(&self, rows: &[[f32; WIDTH]; 8]) -> u32 {
        let corner = |axis: usize| S::F32x8::load(&rows[self.rows[axis] & 7]);
        let n = |axis: usize| S::F32x8::splat(self.n[axis]);
        corner(0).mul_add(n(0), corner(1).mul_add(n(1), corner(2) * n(2))).lt(S::F32x8::splat(self.min))
    }
}
