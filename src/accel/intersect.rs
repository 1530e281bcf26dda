//! Closest hits of a batch of rays: ray packets in the world BVHs, ray streams elsewhere.

use crate::bvh::scene_bvh::SceneBvh;
use crate::packet;
use crate::packet_splitter::{PacketSplitter, can_trace_packet};
use crate::ray_batch::{HitBatch, HitFilter, RayBatch};
use crate::ray_spread::TriangleDensity;
use crate::scratch::TraceScratch;
use crate::single_ray_tracer::SingleRayTracer;
use crate::stream::{ClosestHitStream, Streams};
use blinn_core::simd::{Simd, SimdKernel};

/// [`Accel::intersect`] at a SIMD level.
///
/// [`Accel::intersect`]: crate::Accel::intersect
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
        let mut scratch = TraceScratch::take();
        let mut streams = Streams::new(&mut scratch.stream);
        let density = TriangleDensity::new(bvh);
        let mut splitter = PacketSplitter::new(rays.len());
        while let Some(range) = splitter.pop() {
            let as_packet = rays.source.is_empty()
                && can_trace_packet(bvh, rays.coherence, range.len())
                && !density.are_spread(rays, range.clone());
            let worlds_traced = as_packet && {
                let hits = &mut hits[range.clone()];
                let range = range.clone();
                let stack = &mut tracer.stack;
                packet::intersect::<S>(bvh.worlds(), rays, range, filter, hits, &mut scratch.packet, stack)
            };
            if as_packet && !worlds_traced && splitter.split(range.clone()) {
                continue;
            }
            if worlds_traced && bvh.tlas.is_empty() {
                continue;
            }
            let indices = match worlds_traced {
                true => range.map(|ray| ray as u32).collect(),
                false => streams.push(range).unwrap_or_default(),
            };
            let query = &mut ClosestHitStream { rays, indices: &indices, filter, hits: &mut *hits };
            streams.trace::<S, _>(bvh, query, worlds_traced, &mut tracer);
        }
        let indices = streams.take_pending();
        let query = &mut ClosestHitStream { rays, indices: &indices, filter, hits };
        streams.trace::<S, _>(bvh, query, false, &mut tracer);
        scratch.give_back();
    }
}
