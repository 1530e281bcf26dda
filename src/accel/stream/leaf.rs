//! Intersection of a list of rays with the triangles of a leaf.

use crate::bvh::blas::Blas;
use crate::bvh::instance::BlasInstance;
use crate::bvh::triangle4::{TRIANGLE_LANES, Triangle4};
use crate::stream::list_visitor::ListVisitor;
use crate::stream::prepared_rays::{PreparedRays, STREAM_RAYS, TriangleTestData};
use crate::stream::query::{SingleRayTask, StreamQuery};
use crate::traverse::conservative_triangle_test::Candidates;
use crate::traverse::error_bounds::{EdgeFunctionBounds, W_SCALE};
use crate::traverse::exact_triangle_test::LocalRay;
use crate::traverse::query::RayQuery;
use blinn_core::simd::vec3::{Vec3Lanes, cross, dot, splat, sub};
use blinn_core::simd::{Lanes, Simd, prefetch_all_lines};

/// Intersects lists with the triangles of one BLAS.
pub(super) struct TriangleVisitor<'a, Q> {
    pub blas: &'a Blas,
    /// The frame that rays are traced in; the world without it.
    pub instance: Option<&'a BlasInstance>,
    /// The query's number of each ray, where the stream numbers them otherwise.
    pub query_rays: Option<&'a [u32]>,
    pub bounds: EdgeFunctionBounds,
    pub query: &'a mut Q,
}

/// Inputs of the test of a ray: those of a block, and of any ray.
struct PreparedBlock<S: Simd> {
    v0: Vec3Lanes<S::F32x4>,
    e1: Vec3Lanes<S::F32x4>,
    e2: Vec3Lanes<S::F32x4>,
    n: Vec3Lanes<S::F32x4>,
    error: S::F32x4,
    negative_error: S::F32x4,
    depth_error: S::F32x4,
    min_determinant: S::F32x4,
    lanes: u32,
}

impl<S: Simd> PreparedBlock<S> {
    #[inline(always)]
    fn new(block: &Triangle4, bounds: &EdgeFunctionBounds) -> Self {
        let [v0, v1, v2] = block.load_vertices::<S::F32x4>();
        let e1 = sub(v1, v0);
        let e2 = sub(v2, v0);
        let bounds = bounds.for_max_edge(block.max_edge);
        PreparedBlock {
            v0,
            e1,
            e2,
            n: cross(e1, e2),
            error: S::F32x4::splat(bounds.edge_function),
            negative_error: S::F32x4::splat(-bounds.edge_function),
            depth_error: S::F32x4::splat(bounds.depth),
            min_determinant: S::F32x4::splat(bounds.min_determinant),
            lanes: block.lane_mask(),
        }
    }

    /// Returns the triangles that the ray may hit before its limit, as
    /// [`TriangleTestRay::candidates`] does. u and v are computed from one cross product, (v₀ − o)×d, which has the
    /// same error bounds.
    ///
    /// [`TriangleTestRay::candidates`]: crate::traverse::conservative_triangle_test::TriangleTestRay::candidates
    #[inline(always)]
    fn candidates<const ANY_HIT: bool>(&self, ray: &TriangleTestData) -> Candidates {
        let lanes = S::F32x4::splat;
        let o: Vec3Lanes<S::F32x4> = splat(ray.o.into());
        let d: Vec3Lanes<S::F32x4> = splat(ray.d.into());
        let c = sub(self.v0, o);
        let line = cross(c, d);
        let det = dot(self.n, d);
        let depth = dot(self.n, c);
        let u = dot(line, self.e2);
        let minus_v = dot(line, self.e1);
        let w = (det - u + minus_v) * lanes(W_SCALE);
        let v = minus_v.xor_sign(lanes(-0.0));
        let min = u.min(v).min(w);
        let max = u.max(v).max(w);
        // NaN compares false and stays a candidate.
        let outside = min.lt(self.negative_error) & self.error.lt(max);
        let depth = depth.xor_sign(det);
        let det = det.abs();
        let sign_is_certain = self.min_determinant.lt(det);
        let depth_min = depth - self.depth_error;
        let depth_max = depth + self.depth_error;
        let out_of_range = (det * lanes(ray.limit)).lt(depth_min) | depth_max.lt(lanes(0.0));
        let possible = self.lanes & !outside & !(out_of_range & sign_is_certain);
        if possible == 0 {
            return Candidates::default();
        }
        let inside = possible & sign_is_certain & (self.error.lt(min) | max.lt(self.negative_error));
        let early_exit = match ANY_HIT {
            true => {
                inside
                    & (det * lanes(ray.early_exit_t_min)).lt(depth_min)
                    & depth_max.lt(det * lanes(ray.early_exit_t_max))
            }
            false => 0,
        };
        Candidates { possible, inside, early_exit }
    }
}

impl<S: Simd, Q: StreamQuery> ListVisitor<S> for TriangleVisitor<'_, Q> {
    const ANY_HIT: bool = Q::ANY_HIT;

    #[inline(always)]
    fn visit_leaf(&mut self, leaf: u32, rays: &[u32], prepared_rays: &mut PreparedRays) {
        for block in &self.blas.blocks[leaf as usize..] {
            let prepared = PreparedBlock::<S>::new(block, &self.bounds);
            for &ray in rays {
                let ray = ray as usize & (STREAM_RAYS - 1);
                let test_data = &prepared_rays.triangles[ray];
                let mut candidates = match Q::ANY_HIT {
                    true => prepared.candidates::<true>(test_data),
                    false => prepared.candidates::<false>(test_data),
                };
                if candidates.possible == 0 {
                    continue;
                }
                // Nearly every ray would take the exact test of the triangle that it starts on.
                candidates.possible &= !S::F32x4::eq_u32(&block.indices, test_data.source);
                if candidates.possible == 0 || (Q::ANY_HIT && test_data.limit == f32::NEG_INFINITY) {
                    continue;
                }
                let occluders = candidates.early_exit & u32::from(block.opaque_mask()) & candidates.possible;
                if Q::ANY_HIT && occluders != 0 {
                    self.query.end(self.query_ray(ray));
                    prepared_rays.set_t_max(ray, f32::NEG_INFINITY);
                } else {
                    let t_max = self.test_exactly(block, ray, candidates);
                    prepared_rays.set_t_max(ray, t_max);
                }
            }
            if block.is_last_in_leaf() {
                break;
            }
        }
    }

    #[inline(always)]
    fn prefetch(&self, leaf: u32) {
        if let Some(block) = self.blas.blocks.get(leaf as usize) {
            prefetch_all_lines(block);
        }
    }
}

impl<Q: StreamQuery> TriangleVisitor<'_, Q> {
    /// The query's number of a ray.
    #[inline(always)]
    fn query_ray(&self, ray: usize) -> usize {
        self.query_rays.map_or(ray, |rays| rays[ray] as usize)
    }

    /// Takes the exact test of a ray and the triangles that are left of a block, and records hits. Returns the t beyond
    /// which hits have no effect now.
    #[inline(never)]
    fn test_exactly(&mut self, block: &Triangle4, ray: usize, candidates: Candidates) -> f32 {
        let ray = self.query_ray(ray);
        let TriangleVisitor { blas, instance, .. } = *self;
        let Some(mut local_ray) = self.query.local_ray(ray) else { return f32::NEG_INFINITY };
        if let Some(instance) = instance {
            local_ray = instance.transform.ray(&local_ray);
        }
        self.query.update(ray, ExactTest { blas, instance, local_ray, block, candidates })
    }
}

/// The exact test of a ray and the triangles that are left of a block.
struct ExactTest<'a> {
    blas: &'a Blas,
    instance: Option<&'a BlasInstance>,
    local_ray: LocalRay,
    block: &'a Triangle4,
    candidates: Candidates,
}

impl SingleRayTask for ExactTest<'_> {
    #[inline(always)]
    fn run(self, query: &mut impl RayQuery) {
        let ExactTest { blas, instance, local_ray, block, candidates } = self;
        let mut possible = candidates.possible;
        while possible != 0 {
            let lane = possible.trailing_zeros() as usize & (TRIANGLE_LANES - 1);
            possible &= possible - 1;
            let inside = candidates.inside >> lane & 1 == 1;
            let Some(hit) = local_ray.intersect(&block.vertices(lane), inside) else { continue };
            let instance = instance.map(|instance| instance.instance);
            if blas.report_hit(block, lane, hit, instance, query) {
                break;
            }
        }
    }
}
