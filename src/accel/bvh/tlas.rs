//! Top-level BVH (TLAS): instances of BLASes in the world.

use std::marker::PhantomData;

use glam::DVec3;

use crate::bvh::blas::{Blas, box_limit};
use crate::bvh::bvh8::{Bvh8, LEAF_BIT};
use crate::bvh::instance::BlasInstance;
use crate::traverse::box_test::{BoxTestRay, SimdNodeTest};
use crate::traverse::bvh8_traversal::{LeafVisitor, TraversalStack};
use crate::traverse::exact_triangle_test::LocalRay;
use crate::traverse::query::RayQuery;
use blinn_core::simd::Simd;

/// The BVH over instances.
///
/// A ray is rounded, in f64, when it is transformed into an instance's frame. Seen from the world, it then
/// passes a point p at a distance of up to ε/2 · condition · (2|o| + 3|T| + |p|) from where it should, with the
/// frame's translation T. Boxes are therefore padded, for each ray, by a generous multiple of that.
#[derive(Debug, Default)]
pub(crate) struct Tlas {
    pub bvh: Bvh8,
    /// Instances, sorted by leaf.
    pub instances: Vec<BlasInstance>,
    /// End of each leaf's range in `instances`.
    pub leaf_ends: Vec<u32>,
    /// Padding for a ray from the world's origin.
    pub padding: f32,
    /// Additional padding for each unit of the ray origin's largest coordinate.
    pub padding_per_distance: f32,
}

impl Tlas {
    /// The instances in a leaf.
    #[inline(always)]
    pub fn instances(&self, leaf: u32) -> &[BlasInstance] {
        let first = if leaf == 0 { 0 } else { self.leaf_ends[leaf as usize - 1] };
        &self.instances[first as usize..self.leaf_ends[leaf as usize] as usize]
    }

    /// The padding of boxes for a ray from `o`.
    #[inline(always)]
    pub fn padding(&self, o: DVec3) -> f32 {
        self.padding + self.padding_per_distance * o.abs().max_element() as f32
    }

    /// Returns true if there are no instances.
    pub fn is_empty(&self) -> bool {
        self.bvh.root.is_none()
    }

    /// Reports the triangles that `ray` hits to `query`, in any order. Returns false once the query has ended.
    #[inline(always)]
    pub fn traverse<S: Simd, Q: RayQuery>(
        &self,
        ray: &LocalRay,
        blases: &[&Blas],
        query: &mut Q,
        stack: &mut TraversalStack,
    ) -> bool {
        let Some(root) = self.bvh.root else { return true };
        let box_ray = BoxTestRay::new(ray.o, ray.d, self.padding(ray.o), ray.local_t(query.t_min()));
        let node_test = SimdNodeTest::<S>::new(&box_ray);
        let limit = box_limit(ray, query);
        let mut leaves: InstanceVisitor<S, Q> =
            InstanceVisitor { tlas: self, ray, blases, query, simd: PhantomData };
        match Q::ANY_HIT {
            true => self.bvh.traverse_any(root, &node_test, stack, limit, &mut leaves),
            false => self.bvh.traverse_closest(root, &node_test, stack, limit, &mut leaves),
        }
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.bvh.bytes()
            + self.instances.capacity() * size_of::<BlasInstance>()
            + self.leaf_ends.capacity() * size_of::<u32>()
    }
}

/// Continues a ray in the BLASes of the instances in leaves.
struct InstanceVisitor<'a, S, Q> {
    tlas: &'a Tlas,
    ray: &'a LocalRay,
    blases: &'a [&'a Blas],
    query: &'a mut Q,
    simd: PhantomData<S>,
}

impl<S: Simd, Q: RayQuery> LeafVisitor for InstanceVisitor<'_, S, Q> {
    #[inline(always)]
    fn visit_leaf(&mut self, leaf: u32, stack: &mut TraversalStack) -> Option<f32> {
        for BlasInstance { instance, blas, transform } in self.tlas.instances(leaf) {
            let blas = self.blases[*blas as usize];
            let root = blas.bvh.root.unwrap_or(LEAF_BIT);
            let local_ray = transform.ray(self.ray);
            if !blas.traverse::<S, Q>(root, &local_ray, Some(*instance), self.query, stack) {
                return None;
            }
        }
        Some(box_limit(self.ray, self.query))
    }
}
