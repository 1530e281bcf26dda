//! Closest hits of a batch of rays: ray packets in the world BVHs, single rays elsewhere.

use crate::accel::bvh::scene_bvh::SceneBvh;
use crate::accel::packet::{self, PacketScratch};
use crate::accel::packet_splitter::{PacketSplitter, can_trace_packet};
use crate::accel::ray_batch::{HitBatch, HitFilter, RayBatch};
use crate::accel::single_ray_tracer::SingleRayTracer;
use crate::accel::traverse::exact_triangle_test::LocalRay;
use crate::accel::traverse::query::{ClosestHit, RayContext};
use crate::geometry::{Hit, HitId};
use crate::simd::{Simd, SimdKernel};

/// [`Accel::intersect`] at a SIMD level.
///
/// [`Accel::intersect`]: crate::accel::Accel::intersect
pub(crate) struct IntersectKernel<'a> {
    pub bvh: &'a SceneBvh,
    pub rays: &'a RayBatch,
    pub filter: &'a dyn HitFilter,
    /// Misses, one for each ray.
    pub hits: &'a mut HitBatch,
}

impl SimdKernel for IntersectKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let IntersectKernel { bvh, rays, filter, hits } = self;
        let mut tracer = SingleRayTracer::new(bvh);
        let mut scratch = PacketScratch::default();
        let mut splitter = PacketSplitter::new(rays.len());
        while let Some(range) = splitter.pop() {
            let as_packet = can_trace_packet(bvh, rays.coherence, range.len());
            let worlds_traced = as_packet && {
                let hits = &mut hits[range.clone()];
                let range = range.clone();
                let stack = &mut tracer.stack;
                packet::intersect::<S>(bvh.worlds(), rays, range, filter, hits, &mut scratch, stack)
            };
            if as_packet && !worlds_traced && splitter.split(range.clone()) {
                continue;
            }
            if worlds_traced && bvh.tlas.is_empty() {
                continue;
            }
            for i in range {
                let hit = &mut hits[i];
                let o = rays.origins[i];
                let d = rays.directions[i];
                let best = if hit.is_miss() { Hit { t: rays.t_max, id: HitId::NONE } } else { *hit };
                let ray = RayContext { o, d, filter };
                let cull_back_faces = rays.cull_back_faces;
                let mut query = ClosestHit { ray, cull_back_faces, after: rays.after(i), best };
                if let Some(ray) = LocalRay::new(o.as_dvec3(), d.as_dvec3()) {
                    tracer.trace::<S>(&ray, worlds_traced, &mut query);
                }
                if !query.best.is_miss() {
                    *hit = query.best;
                }
            }
        }
    }
}
