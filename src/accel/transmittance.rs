//! Transmittance of a batch of segments: any-hit traversal that goes on through translucent surfaces.

use crate::accel::bvh::scene_bvh::SceneBvh;
use crate::accel::packet::{self, PACKET_SIZE, PacketOcclusion, PacketScratch};
use crate::accel::packet_splitter::{PacketSplitter, can_trace_packet};
use crate::accel::ray_batch::{Coherence, HitFilter, ShadowRayBatch};
use crate::accel::single_ray_tracer::{SingleRayTracer, shadow_ray_query};
use crate::accel::traverse::translucent_hits::Transmittance;
use crate::geometry::Rgb;
use crate::simd::{Simd, SimdKernel};

/// [`Accel::transmittance`] at a SIMD level.
///
/// [`Accel::transmittance`]: crate::accel::Accel::transmittance
pub(crate) struct TransmittanceKernel<'a> {
    pub bvh: &'a SceneBvh,
    pub segments: &'a ShadowRayBatch,
    pub filter: &'a dyn HitFilter,
    /// Empty; takes an answer for each segment.
    pub out: &'a mut Vec<Rgb>,
}

impl SimdKernel for TransmittanceKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let TransmittanceKernel { bvh, segments, filter, out } = self;
        let mut tracer = SingleRayTracer::new(bvh);
        let mut scratch = PacketScratch::default();
        let mut transmittances = vec![Transmittance::default(); PACKET_SIZE].into_boxed_slice();
        let t_max = if matches!(segments.coherence, Coherence::Direction(_)) { f32::INFINITY } else { 1.0 };
        let mut splitter = PacketSplitter::new(segments.len());
        while let Some(range) = splitter.pop() {
            transmittances.iter_mut().for_each(Transmittance::clear);
            let mut occlusion = PacketOcclusion::new(Some(&mut transmittances));
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
            if as_packet && !worlds_traced {
                if splitter.split(range.clone()) {
                    continue;
                }
                // All BVHs are traversed again.
                occlusion.clear_transmittance();
            }
            let remaining = !worlds_traced || !bvh.tlas.is_empty();
            for (i, segment) in range.enumerate() {
                let mut occluded = occlusion.is_occluded(i);
                if remaining && !occluded {
                    let transmittance = occlusion.transmittance(i);
                    let (ray, mut query) = shadow_ray_query(segments, segment, filter, transmittance);
                    if let Some(ray) = ray {
                        tracer.trace::<S>(&ray, worlds_traced, &mut query);
                    }
                    occluded = query.occluded;
                }
                out.push(match occlusion.transmittance(i) {
                    Some(transmittance) if !occluded => transmittance.of_ray(t_max),
                    _ => Rgb::ZERO,
                });
            }
        }
    }
}
