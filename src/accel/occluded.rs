//! Occlusion (any hit) of a batch of segments: ray packets in the world BVHs, single rays elsewhere.

use crate::accel::bvh::scene_bvh::SceneBvh;
use crate::accel::packet::{self, Answers, GROUPS, Packet, PacketStack};
use crate::accel::packet_splitter::{PacketSplitter, can_trace_packet};
use crate::accel::ray_batch::{AnyHitFilter, SegmentBatch};
use crate::accel::single_ray_tracer::{SingleRayTracer, segment_query};
use crate::simd::{Simd, SimdKernel};

/// [`Accel::occluded`] at a SIMD level.
///
/// [`Accel::occluded`]: crate::accel::Accel::occluded
pub(crate) struct OccludedKernel<'a> {
    pub bvh: &'a SceneBvh,
    pub segments: &'a SegmentBatch,
    pub filter: &'a dyn AnyHitFilter,
    /// Empty; takes an answer for each segment.
    pub out: &'a mut Vec<bool>,
}

impl SimdKernel for OccludedKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let OccludedKernel { bvh, segments, filter, out } = self;
        let mut tracer = SingleRayTracer::new(bvh);
        let mut packet = Packet::default();
        let mut packets = PacketStack::default();
        let mut splitter = PacketSplitter::new(segments.len());
        while let Some(range) = splitter.pop() {
            let mut answers = Answers { blocked: [0; GROUPS], passing: None };
            let as_packet = can_trace_packet(bvh, segments.coherence, range.len());
            let worlds_done = as_packet && {
                let scratch = (&mut packet, &mut packets, &mut tracer.stack);
                let some = (segments, range.start, range.len());
                packet::occluded::<S>(&bvh.worlds, some, filter, &mut answers, scratch)
            };
            if as_packet && !worlds_done && splitter.split(range.clone()) {
                continue;
            }
            if worlds_done && bvh.tlas.is_empty() {
                out.extend((0..range.len()).map(|i| answers.blocked(i)));
                continue;
            }
            for (i, segment) in range.enumerate() {
                let mut blocked = answers.blocked(i);
                if !blocked {
                    let (ray, mut query) = segment_query(segments, segment, filter, None);
                    if let Some(ray) = ray {
                        tracer.trace::<S>(&ray, worlds_done, &mut query);
                    }
                    blocked = query.blocked;
                }
                out.push(blocked);
            }
        }
    }
}
