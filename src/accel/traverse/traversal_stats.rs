//! Traversal statistics: the nodes and blocks that a ray visits.
//!
//! Rays are traced one by one, by the traversals of other single rays ([`Bvh8::traverse_closest`] and
//! [`Bvh8::traverse_any`]), but with a node test in f64 that counts. So counts do not depend on the SIMD level, and
//! other rays do not pay for counting.
//!
//! [`Bvh8::traverse_closest`]: crate::bvh::bvh8::Bvh8::traverse_closest
//! [`Bvh8::traverse_any`]: crate::bvh::bvh8::Bvh8::traverse_any

use std::cell::Cell;

use glam::DVec3;

use crate::bvh::aabb::Aabb;
use crate::bvh::blas::{Blas, box_limit};
use crate::bvh::bvh8::{Bvh8, Bvh8Node, Octant, WIDTH};
use crate::bvh::instance::BlasInstance;
use crate::bvh::scene_bvh::SceneBvh;
use crate::ray_batch::{HitFilter, RayBatch, ShadowRayBatch};
use crate::single_ray_tracer::shadow_ray_query;
use crate::traverse::box_test::{NEAR_FACTOR, NodeTest, OrderedNodeTest, direction_reciprocal};
use crate::traverse::bvh8_traversal::{LeafVisitor, TraversalStack};
use crate::traverse::exact_triangle_test::LocalRay;
use crate::traverse::query::{ClosestHit, FilteredRay, RayQuery};
use blinn_core::geometry::{EPSILON, Hit, HitId};

/// Number of nodes, blocks and triangles that a ray visits until its answer is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraversalStats {
    /// Inner nodes of all BVHs, each with up to eight boxes.
    pub nodes: u32,
    /// Leaf blocks of up to four triangles, or of up to eight points or lines.
    pub blocks: u32,
    /// Triangles, points and lines of these blocks.
    pub triangles: u32,
}

impl TraversalStats {
    /// Adds the visits of another traversal by the same ray.
    pub(crate) fn add(&mut self, other: TraversalStats) {
        self.nodes += other.nodes;
        self.blocks += other.blocks;
        self.triangles += other.triangles;
    }
}

/// Returns the closest hit of each ray with the statistics of its traversal.
pub(crate) fn intersect_with_stats(
    bvh: &SceneBvh,
    rays: &RayBatch,
    filter: &dyn HitFilter,
) -> Vec<(Hit, TraversalStats)> {
    let blases: Vec<&Blas> = bvh.mesh_blases.values().collect();
    let mut stack = TraversalStack::default();
    let trace = |i: usize| {
        let o = rays.origins[i];
        let d = rays.directions[i];
        let best = Hit { t: rays.t_max, id: HitId::NONE };
        let ray = FilteredRay { o, d, filter };
        let cull_back_faces = rays.cull_back_faces;
        let query = ClosestHit { ray, cull_back_faces, source: rays.source(i), after: rays.after(i), best };
        let mut tracer = CountingTracer { bvh, blases: &blases, query, stats: TraversalStats::default() };
        if let Some(ray) = LocalRay::new(o.as_dvec3(), d.as_dvec3()) {
            tracer.trace(&ray, &mut stack);
        }
        let CountingTracer { query: ClosestHit { best, .. }, stats, .. } = tracer;
        (if best.is_miss() { Hit::MISS } else { best }, stats)
    };
    (0..rays.len()).map(trace).collect()
}

/// Returns whether each shadow ray is occluded with the statistics of its traversal.
pub(crate) fn occluded_with_stats(
    bvh: &SceneBvh,
    rays: &ShadowRayBatch,
    filter: &dyn HitFilter,
) -> Vec<(bool, TraversalStats)> {
    let blases: Vec<&Blas> = bvh.mesh_blases.values().collect();
    let mut stack = TraversalStack::default();
    let trace = |i: usize| {
        let (ray, query) = shadow_ray_query(rays, i, filter, None);
        let mut tracer = CountingTracer { bvh, blases: &blases, query, stats: TraversalStats::default() };
        if let Some(ray) = ray {
            tracer.trace(&ray, &mut stack);
        }
        (tracer.query.occluded, tracer.stats)
    };
    (0..rays.len()).map(trace).collect()
}

/// Traces one ray and counts.
struct CountingTracer<'a, Q> {
    bvh: &'a SceneBvh,
    /// The BLASes of the TLAS, by their number there.
    blases: &'a [&'a Blas],
    query: Q,
    stats: TraversalStats,
}

impl<Q: RayQuery> CountingTracer<'_, Q> {
    fn trace(&mut self, ray: &LocalRay, stack: &mut TraversalStack) {
        let SceneBvh { tlas, .. } = self.bvh;
        for world in self.bvh.worlds() {
            if !self.trace_blas(world, ray, None, stack) {
                return;
            }
        }
        let leaves = |tracer: &mut Self, leaf: u32, stack: &mut TraversalStack| {
            tlas.instances(leaf).iter().all(|BlasInstance { instance, blas, transform }| {
                let blas = tracer.blases[*blas as usize];
                tracer.trace_blas(blas, &transform.ray(ray), Some(*instance), stack)
            })
        };
        self.traverse(&tlas.bvh, ray, f64::from(tlas.padding(ray.o)), stack, leaves);
    }

    /// Traces the ray through a BLAS. Returns false once the query has ended.
    fn trace_blas(
        &mut self,
        blas: &Blas,
        ray: &LocalRay,
        instance: Option<u32>,
        stack: &mut TraversalStack,
    ) -> bool {
        let leaves = |tracer: &mut Self, leaf: u32, _: &mut TraversalStack| {
            for block in &blas.blocks[leaf as usize..] {
                tracer.stats.blocks += 1;
                tracer.stats.triangles += block.count() as u32;
                for lane in 0..block.count() {
                    if let Some(hit) = ray.intersect_f64(&block.vertices(lane))
                        && blas.report_hit(block, lane, hit, instance, &mut tracer.query)
                    {
                        return false;
                    }
                }
                if block.is_last_in_leaf() {
                    break;
                }
            }
            true
        };
        self.traverse(&blas.bvh, ray, 0.0, stack, leaves)
    }

    /// Traverses a BVH whose boxes are padded, with `visit_leaf` at leaves: it returns false where the query ends.
    /// Returns false once the query has ended.
    fn traverse(
        &mut self,
        bvh: &Bvh8,
        ray: &LocalRay,
        padding: f64,
        stack: &mut TraversalStack,
        visit_leaf: impl FnMut(&mut Self, u32, &mut TraversalStack) -> bool,
    ) -> bool {
        let Some(root) = bvh.root else { return true };
        let t_min = ray.local_t(self.query.t_min()) * NEAR_FACTOR;
        let limit = box_limit(ray, &self.query);
        if t_min > limit {
            return true;
        }
        let test = CountingNodeTest::new(ray, padding, t_min);
        let mut leaves = CountingVisitor { tracer: self, ray, visit_leaf };
        let goes_on = match Q::ANY_HIT {
            true => bvh.traverse_any(root, &test, stack, limit, &mut leaves),
            false => bvh.traverse_closest(root, &test, stack, limit, &mut leaves),
        };
        self.stats.nodes += test.nodes.get();
        goes_on
    }
}

struct CountingVisitor<'a, T, F> {
    tracer: &'a mut T,
    ray: &'a LocalRay,
    visit_leaf: F,
}

impl<'a, Q, F> LeafVisitor for CountingVisitor<'_, CountingTracer<'a, Q>, F>
where
    Q: RayQuery,
    F: FnMut(&mut CountingTracer<'a, Q>, u32, &mut TraversalStack) -> bool,
{
    fn visit_leaf(&mut self, leaf: u32, stack: &mut TraversalStack) -> Option<f32> {
        let goes_on = (self.visit_leaf)(self.tracer, leaf, stack);
        goes_on.then(|| box_limit(self.ray, &self.tracer.query))
    }
}

/// A ray prepared for box tests in f64.
struct CountingNodeTest {
    o: DVec3,
    d_reciprocal: DVec3,
    padding: f64,
    t_min: f64,
    octant: Octant,
    /// Number of nodes tested.
    nodes: Cell<u32>,
}

impl CountingNodeTest {
    fn new(ray: &LocalRay, padding: f64, t_min: f32) -> CountingNodeTest {
        let d = ray.d.as_vec3();
        CountingNodeTest {
            o: ray.o,
            d_reciprocal: direction_reciprocal(d).as_dvec3(),
            padding,
            t_min: f64::from(t_min),
            octant: Octant::of(d),
            nodes: Cell::new(0),
        }
    }

    /// Returns where the ray enters a box, if it does before `limit`, with slack for rounding.
    fn entry(&self, bounds: Aabb, limit: f64) -> Option<f64> {
        const SLACK: f64 = 4.0 * EPSILON as f64;
        let mut near = self.t_min;
        let mut far = limit;
        for axis in 0..3 {
            let o = self.o[axis];
            let r = self.d_reciprocal[axis];
            let padding = self.padding + SLACK * o.abs();
            let a = (f64::from(bounds.min[axis]) - padding - o) * r;
            let b = (f64::from(bounds.max[axis]) + padding - o) * r;
            near = near.max(a.min(b) - SLACK * a.min(b).abs());
            far = far.min(a.max(b) + SLACK * a.max(b).abs());
        }
        (near <= far).then_some(near)
    }
}

impl OrderedNodeTest for CountingNodeTest {
    fn sort_hit_children(
        &self,
        node: &Bvh8Node,
        limit: f32,
        near: &mut [f32; WIDTH],
        child: &mut [u32; WIDTH],
    ) -> (usize, u32) {
        self.nodes.set(self.nodes.get() + 1);
        let mut count = 0;
        let mut nearest = 0;
        for slot in node.order(self.octant).map(|slot| slot as usize & (WIDTH - 1)) {
            if slot < node.count()
                && let Some(entry) = self.entry(node.bounds(slot), f64::from(limit))
            {
                near[count] = round_up(entry);
                child[count] = node.child[slot];
                nearest = node.child[slot];
                count += 1;
            }
        }
        (count, nearest)
    }
}

impl NodeTest for CountingNodeTest {
    fn hit_mask(&self, node: &Bvh8Node, limit: f32) -> u32 {
        self.nodes.set(self.nodes.get() + 1);
        let is_hit = |&slot: &usize| self.entry(node.bounds(slot), f64::from(limit)).is_some();
        (0..node.count()).filter(is_hit).fold(0, |mask, slot| mask | 1 << slot)
    }
}

/// Rounds up to f32: a number exceeds an f32 limit exactly where the rounded one does.
fn round_up(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x { rounded.next_up() } else { rounded }
}
