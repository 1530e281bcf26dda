//! Occlusion (any hit) and transmittance of a batch of shadow rays: ray packets in the world BVHs, single rays elsewhere.

use crate::accel::bvh::scene_bvh::SceneBvh;
use crate::accel::packet::{self, PACKET_SIZE, PacketOcclusion, PacketScratch};
use crate::accel::packet_splitter::{PacketSplitter, can_trace_packet};
use crate::accel::ray_batch::{Coherence, HitFilter, ShadowRayBatch};
use crate::accel::single_ray_tracer::{SingleRayTracer, shadow_ray_query};
use crate::accel::traverse::translucent_hits::Transmittance;
use crate::geometry::Rgb;
use crate::simd::{Simd, SimdKernel};

/// The answer for a shadow ray: `bool` for occlusion by opaque surfaces, [`Rgb`] for transmittance.
pub(crate) trait ShadowRayAnswer: Sized {
    /// True if translucent surfaces are collected; they are ignored otherwise.
    const COLLECTS_TRANSMITTANCE: bool;

    /// Returns the answer for a ray that ends at `t_max`. `transmittance` has its translucent surfaces if they are
    /// collected.
    fn new(occluded: bool, transmittance: Option<&mut Transmittance>, t_max: f32) -> Self;
}

impl ShadowRayAnswer for bool {
    const COLLECTS_TRANSMITTANCE: bool = false;

    #[inline(always)]
    fn new(occluded: bool, _: Option<&mut Transmittance>, _: f32) -> bool {
        occluded
    }
}

impl ShadowRayAnswer for Rgb {
    const COLLECTS_TRANSMITTANCE: bool = true;

    #[inline(always)]
    fn new(occluded: bool, transmittance: Option<&mut Transmittance>, t_max: f32) -> Rgb {
        match transmittance {
            Some(transmittance) if !occluded => transmittance.of_ray(t_max),
            _ => Rgb::ZERO,
        }
    }
}

/// [`Accel::occluded`] and [`Accel::transmittance`] at a SIMD level.
///
/// [`Accel::occluded`]: crate::accel::Accel::occluded
/// [`Accel::transmittance`]: crate::accel::Accel::transmittance
pub(crate) struct ShadowRayKernel<'a, A> {
    pub bvh: &'a SceneBvh,
    pub rays: &'a ShadowRayBatch,
    pub filter: &'a dyn HitFilter,
    /// Empty; receives one answer per ray.
    pub out: &'a mut Vec<A>,
}

impl<A: ShadowRayAnswer> SimdKernel for ShadowRayKernel<'_, A> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let ShadowRayKernel { bvh, rays, filter, out } = self;
        let mut tracer = SingleRayTracer::new(bvh);
        let mut scratch = PacketScratch::default();
        let collected = if A::COLLECTS_TRANSMITTANCE { PACKET_SIZE } else { 0 };
        let mut transmittances = vec![Transmittance::default(); collected].into_boxed_slice();
        let t_max = if matches!(rays.coherence, Coherence::Direction(_)) { f32::INFINITY } else { 1.0 };
        let mut splitter = PacketSplitter::new(rays.len());
        while let Some(range) = splitter.pop() {
            transmittances.iter_mut().for_each(Transmittance::clear);
            let collect = A::COLLECTS_TRANSMITTANCE.then_some(&mut *transmittances);
            let mut occlusion = PacketOcclusion::new(collect);
            let as_packet = can_trace_packet(bvh, rays.coherence, range.len());
            let worlds_traced = as_packet
                && packet::occluded::<S>(
                    bvh.worlds(),
                    rays,
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
            for (i, ray) in range.enumerate() {
                let mut occluded = occlusion.is_occluded(i);
                if remaining && !occluded {
                    let transmittance = occlusion.transmittance(i);
                    let (local_ray, mut query) = shadow_ray_query(rays, ray, filter, transmittance);
                    if let Some(local_ray) = local_ray {
                        tracer.trace::<S>(&local_ray, worlds_traced, &mut query);
                    }
                    occluded = query.occluded;
                }
                out.push(A::new(occluded, occlusion.transmittance(i), t_max));
            }
        }
    }
}
