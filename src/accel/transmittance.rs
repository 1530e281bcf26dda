//! Transmittance of a batch of segments: any-hit traversal that goes on through translucent surfaces.

use crate::accel::bvh::scene_bvh::SceneBvh;
use crate::accel::packet::{self, Answers, GROUP, GROUPS, Packet, PacketStack, RAYS};
use crate::accel::packet_splitter::{PacketSplitter, can_trace_packet};
use crate::accel::ray_batch::{AnyHitFilter, SegmentBatch};
use crate::accel::single_ray_tracer::{SingleRayTracer, segment_query};
use crate::accel::traverse::transmittance::Transmittance;
use crate::geometry::Rgb;
use crate::simd::{Simd, SimdKernel};

/// [`Accel::transmittance`] at a SIMD level.
///
/// [`Accel::transmittance`]: crate::accel::Accel::transmittance
pub(crate) struct TransmittanceKernel<'a> {
    pub bvh: &'a SceneBvh,
    pub segments: &'a SegmentBatch,
    pub filter: &'a dyn AnyHitFilter,
    /// Empty; takes an answer for each segment.
    pub out: &'a mut Vec<Rgb>,
}

impl SimdKernel for TransmittanceKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let TransmittanceKernel { bvh, segments, filter, out } = self;
        let mut tracer = SingleRayTracer::new(bvh);
        let mut packet = Packet::default();
        let mut packets = PacketStack::default();
        let mut passing: Box<[Transmittance]> = (0..RAYS).map(|_| Transmittance::default()).collect();
        let mut splitter = PacketSplitter::new(segments.len());
        while let Some(range) = splitter.pop() {
            passing.iter_mut().for_each(Transmittance::clear);
            let mut blocked = [0; GROUPS];
            let as_packet = can_trace_packet(bvh, segments.coherence, range.len());
            let worlds_done = as_packet && {
                let mut answers = Answers { blocked, passing: Some(&mut passing) };
                let scratch = (&mut packet, &mut packets, &mut tracer.stack);
                let some = (segments, range.start, range.len());
                let done = packet::occluded::<S>(&bvh.worlds, some, filter, &mut answers, scratch);
                blocked = answers.blocked;
                done
            };
            if as_packet && !worlds_done {
                if splitter.split(range.clone()) {
                    continue;
                }
                // All BVHs are traversed again.
                passing.iter_mut().for_each(Transmittance::clear);
            }
            let remaining = !worlds_done || !bvh.tlas.is_empty();
            for ((i, segment), passing) in range.enumerate().zip(passing.iter_mut()) {
                let mut blocked = blocked[i / GROUP] >> (i % GROUP) & 1 == 1;
                if remaining && !blocked {
                    let (ray, mut query) = segment_query(segments, segment, filter, Some(&mut *passing));
                    if let Some(ray) = ray {
                        tracer.trace::<S>(&ray, worlds_done, &mut query);
                    }
                    blocked = query.blocked;
                }
                out.push(if blocked { Rgb::ZERO } else { passing.light() });
            }
        }
    }
}
