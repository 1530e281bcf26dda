//! Bottom-level BVH (BLAS): triangles in one frame, and the traversal of single rays down to them.

use std::marker::PhantomData;

use glam::{DVec3, Vec3};

use crate::bvh::aabb::Aabb;
use crate::bvh::bvh8::Bvh8;
use crate::bvh::coincident::CoincidentGroup;
use crate::bvh::huge_pages::HugePageArray;
use crate::bvh::surface_flags::SurfaceFlags;
use crate::bvh::triangle_ids::TriangleIdMap;
use crate::bvh::triangle4::{COINCIDENT, TRIANGLE_LANES, Triangle4};
use crate::report::BuildReport;
use crate::traverse::box_test::{BoxTestRay, SimdNodeTest};
use crate::traverse::bvh8_traversal::{LeafVisitor, TraversalStack};
use crate::traverse::conservative_triangle_test::TriangleTestRay;
use crate::traverse::exact_triangle_test::{LocalRay, TriangleHit};
use crate::traverse::query::{CoincidentIds, RayQuery};
use blinn_core::geometry::HitId;
use blinn_core::simd::{Lanes, OutlinedKernel, Simd};
use blinn_scene::SurfaceClass;

/// No triangle's index, nor that of a set of coincident ones.
pub(crate) const NO_SOURCE: u32 = u32::MAX;

/// Triangles and the BVH over them.
#[derive(Debug, Default)]
pub(crate) struct Blas {
    pub bvh: Bvh8,
    /// Blocks of leaves: leaf n of the BVH begins at `blocks[n]`.
    pub blocks: HugePageArray<Triangle4>,
    pub ids: TriangleIdMap,
    /// Number of input triangles, rejected ones included.
    pub input_count: usize,
    /// Sets of coincident triangles, each in groups of equal flags.
    pub coincident: Vec<Vec<CoincidentGroup>>,
    /// Triangles in `blocks`; coincident ones count once.
    pub triangle_count: usize,
    /// Bounds of all triangles; `None` where there are none.
    pub bounds: Option<Aabb>,
    pub report: BuildReport,
    /// Centre of the bounds.
    pub centre: DVec3,
    /// Half of the bounds' diagonal.
    pub radius: f64,
    /// SAH cost at the time of the build, known after the first refit.
    pub built_cost: Option<f64>,
}

impl Blas {
    /// Updates the bounds from those of the BVH.
    pub fn update_bounds(&mut self) {
        self.bounds = self.bvh.root.map(|_| self.bvh.bounds);
        let bounds = self.bounds.unwrap_or(Aabb { min: Vec3::ZERO, max: Vec3::ZERO });
        self.centre = bounds.centre();
        self.radius = 0.5 * bounds.min.as_dvec3().distance(bounds.max.as_dvec3());
    }

    /// Reports the triangles that `ray` hits in and below `child`, a node or a leaf, to `query`, in any order. Returns
    /// false once the query has ended. `instance` is the owner of the triangles of an instanced mesh.
    #[inline(always)]
    pub fn traverse<S: Simd, Q: RayQuery>(
        &self,
        child: u32,
        ray: &LocalRay,
        instance: Option<u32>,
        query: &mut Q,
        stack: &mut TraversalStack,
    ) -> bool {
        S::call_outlined(TraverseBlasKernel { blas: self, child, ray, instance, query, stack })
    }

    /// Reports that a ray hits the triangle in a lane of a block. Returns true if the query ends.
    #[inline(always)]
    pub fn report_hit(
        &self,
        block: &Triangle4,
        lane: usize,
        hit: TriangleHit,
        instance: Option<u32>,
        query: &mut impl RayQuery,
    ) -> bool {
        let index = block.indices[lane];
        let mut report = |flags: SurfaceFlags, indices: &[u32]| {
            // An occluder may be reported by both triangles at an edge; a transmitting surface counts once.
            if flags.class == SurfaceClass::Translucent && !hit.owned {
                return false;
            }
            let ids = CoincidentIds { indices, id_map: &self.ids, instance };
            query.record_hit(hit.t, flags, hit.ccw == flags.reversed, ids).is_break()
        };
        match index & COINCIDENT {
            0 => report(block.flags(lane), std::slice::from_ref(&index)),
            _ => self.coincident[(index & !COINCIDENT) as usize].iter().any(|g| report(g.flags, &g.indices)),
        }
    }

    /// The id of the triangle in a lane that holds no coincident ones.
    #[inline(always)]
    fn single_id<'b>(
        &'b self,
        block: &'b Triangle4,
        lane: usize,
        instance: Option<u32>,
    ) -> CoincidentIds<'b> {
        CoincidentIds { indices: std::slice::from_ref(&block.indices[lane]), id_map: &self.ids, instance }
    }

    /// Returns the index of the triangle `source` of the scene, or [`NO_SOURCE`] where it is not one of this BLAS's.
    #[inline(always)]
    pub fn source_index(&self, source: HitId, instance: Option<u32>) -> u32 {
        match instance {
            None => self.ids.index(source).unwrap_or(NO_SOURCE),
            Some(instance) if instance == source.instance => source.triangle,
            Some(_) => NO_SOURCE,
        }
    }

    /// Returns the block and lane of a triangle slot: the block's index times [`TRIANGLE_LANES`] plus the lane.
    #[inline(always)]
    pub fn block_and_lane(&self, triangle_slot: u32) -> (&Triangle4, usize) {
        let slot = triangle_slot as usize;
        (&self.blocks[slot / TRIANGLE_LANES], slot % TRIANGLE_LANES)
    }

    /// The largest absolute coordinate.
    pub fn max_coordinate(&self) -> f32 {
        self.bounds.map_or(0.0, Aabb::max_abs_coordinate)
    }

    /// Returns true if there are no triangles.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        let coincident: usize =
            self.coincident.iter().flatten().map(|g| g.indices.len() * size_of::<u32>()).sum();
        self.bvh.bytes() + self.blocks.bytes() + coincident
    }
}

/// The limit on box entry distances for a query.
#[inline(always)]
pub(crate) fn box_limit(ray: &LocalRay, query: &impl RayQuery) -> f32 {
    BoxTestRay::limit(ray.local_t(query.t_max()))
}

/// [`Blas::traverse`] as a function of its own.
struct TraverseBlasKernel<'a, Q> {
    blas: &'a Blas,
    child: u32,
    ray: &'a LocalRay,
    instance: Option<u32>,
    query: &'a mut Q,
    stack: &'a mut TraversalStack,
}

impl<S: Simd, Q: RayQuery> OutlinedKernel<S> for TraverseBlasKernel<'_, Q> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let TraverseBlasKernel { blas, child, ray, instance, query, stack } = self;
        let box_ray = BoxTestRay::new(ray.o, ray.d, 0.0, ray.local_t(query.t_min()));
        let node_test = SimdNodeTest::<S>::new(&box_ray);
        let triangle_ray = TriangleTestRay::new(ray, blas.centre, blas.radius, query.early_exit_t_max());
        let limit = box_limit(ray, query);
        let source = blas.source_index(query.source(), instance);
        let blocks: &[Triangle4] = &blas.blocks;
        let mut leaves: TriangleIntersector<S, Q> = TriangleIntersector {
            blas,
            blocks,
            ray,
            triangle_ray,
            instance,
            query,
            limit,
            source,
            simd: PhantomData,
        };
        match Q::ANY_HIT {
            true => blas.bvh.traverse_any(child, &node_test, stack, limit, &mut leaves),
            false => blas.bvh.traverse_closest(child, &node_test, stack, limit, &mut leaves),
        }
    }
}

/// Intersects a ray with the triangles of leaves.
struct TriangleIntersector<'a, S, Q> {
    blas: &'a Blas,
    blocks: &'a [Triangle4],
    ray: &'a LocalRay,
    triangle_ray: TriangleTestRay,
    instance: Option<u32>,
    query: &'a mut Q,
    limit: f32,
    /// Index of the triangle that the ray starts on, or [`NO_SOURCE`].
    source: u32,
    simd: PhantomData<S>,
}

impl<S: Simd, Q: RayQuery> LeafVisitor for TriangleIntersector<'_, S, Q> {
    #[inline(always)]
    fn visit_leaf(&mut self, leaf: u32, _: &mut TraversalStack) -> Option<f32> {
        for block in &self.blocks[leaf as usize..] {
            if !self.intersect(block) {
                return None;
            }
            if block.is_last_in_leaf() {
                break;
            }
        }
        Some(self.limit)
    }
}

impl<S: Simd, Q: RayQuery> TriangleIntersector<'_, S, Q> {
    /// Intersects the ray with four triangles: a conservative f32 test of all, the exact test for those that
    /// it leaves. Returns false if the query ends.
    #[inline(always)]
    fn intersect(&mut self, block: &Triangle4) -> bool {
        let candidates = self.triangle_ray.candidates::<S>(block, self.limit);
        let mut possible = candidates.possible;
        if possible != 0 {
            // Nearly every such ray would take the exact test of its own triangle.
            possible &= !S::F32x4::eq_u32(&block.indices, self.source);
        }
        while possible != 0 {
            let lane = possible.trailing_zeros() as usize & (TRIANGLE_LANES - 1);
            possible &= possible - 1;
            if candidates.early_exit >> lane & 1 == 1 {
                let ids = self.blas.single_id(block, lane, self.instance);
                if self.query.early_exit(block, lane, ids) {
                    return false;
                }
            }
            let inside = candidates.inside >> lane & 1 == 1;
            let Some(hit) = self.ray.intersect(&block.vertices(lane), inside) else { continue };
            if self.blas.report_hit(block, lane, hit, self.instance, self.query) {
                return false;
            }
            self.limit = box_limit(self.ray, self.query);
        }
        true
    }
}
