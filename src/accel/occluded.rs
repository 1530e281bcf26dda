//! Occlusion (any hit) of a batch of segments: ray packets in the world BVHs, single rays elsewhere.

use crate::accel::bvh::scene_bvh::SceneBvh;
use crate::accel::packet::{self, PacketOcclusion, PacketScratch};
use crate::accel::packet_splitter::{PacketSplitter, can_trace_packet};
use crate::accel::ray_batch::{HitFilter, ShadowRayBatch};
use crate::accel::single_ray_tracer::{SingleRayTracer, shadow_ray_query};
use crate::simd::{Simd, SimdKernel};

/// [`Accel::occluded`] at a SIMD level.
///
/// [`Accel::occluded`]: crate::accel::Accel::occluded
pub(crate) struct OccludedKernel<'a> {
    pub bvh: &'a SceneBvh,
    pub segments: &'a ShadowRayBatch,
    pub filter: &'a dyn HitFilter,
    /// Empty; takes an answer for each segment.
    pub out: &'a mut Vec<bool>,
}

impl SimdKernel for OccludedKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let OccludedKernel { bvh, segments, filter, out } = self;
        let mut tracer = SingleRayTracer::new(bvh);
        let mut scratch = PacketScratch::default();
        let mut splitter = PacketSplitter::new(segments.len());
        while let Some(range) = splitter.pop() {
            let mut occlusion = PacketOcclusion::new(None);
            let as_packet = can_trace_packet(bvh, segments.coherence, range.len());
            let worlds_traced = as_packet
                && packet::occluded::<S>(
                    &bvh.worlds,
                    segments,
                    range.clone(),
                    filter,
                    &mut occlusion,
                    &mut scratch,
                    &mut tracer.stack,
                );
            if as_packet && !worlds_traced && splitter.split(range.clone()) {
                continue;
            }
            if worlds_traced && bvh.tlas.is_empty() {
                out.extend((0..range.len()).map(|i| occlusion.is_occluded(i)));
                continue;
            }
            for (i, segment) in range.enumerate() {
                let mut occluded = occlusion.is_occluded(i);
                if !occluded {
                    let (ray, mut query) = shadow_ray_query(segments, segment, filter, None);
                    if let Some(ray) = ray {
                        tracer.trace::<S>(&ray, worlds_traced, &mut query);
                    }
                    occluded = query.occluded;
                }
                out.push(occluded);
            }
        }
    }
}
