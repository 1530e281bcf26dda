//! Occlusion (any hit) and transmittance of a batch of shadow rays: ray packets in the world BVHs,
//! ray streams elsewhere.

use std::ops::Range;

use crate::bvh::scene_bvh::SceneBvh;
use crate::packet::{self, PACKET_SIZE, PacketOcclusion};
use crate::packet_splitter::{PacketSplitter, can_trace_packet};
use crate::ray_batch::{Coherence, HitFilter, ShadowRayBatch};
use crate::ray_spread::TriangleDensity;
use crate::scratch::TraceScratch;
use crate::single_ray_tracer::SingleRayTracer;
use crate::stream::{AnyHitStream, STREAM_RAYS, Streams};
use crate::traverse::translucent_hits::Transmittance;
use blinn_core::geometry::Rgb;
use blinn_core::simd::{Simd, SimdKernel};

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
/// [`Accel::occluded`]: crate::Accel::occluded
/// [`Accel::transmittance`]: crate::Accel::transmittance
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
        let t_max = if matches!(rays.coherence, Coherence::Direction(_)) { f32::INFINITY } else { 1.0 };
        out.resize_with(rays.len(), || A::new(false, None, t_max));
        let mut tracer = SingleRayTracer::new(bvh);
        let mut scratch = TraceScratch::take();
        let mut streams = Streams::new(&mut scratch.stream);
        let collected = |count: usize| if A::COLLECTS_TRANSMITTANCE { count.min(rays.len()) } else { 0 };
        let mut packet_transmittances = vec![Transmittance::default(); collected(PACKET_SIZE)];
        let transmittances = vec![Transmittance::default(); collected(STREAM_RAYS)];
        let tracer = &mut tracer;
        let mut batch = StreamBatch { bvh, rays, filter, out, t_max, tracer, transmittances };
        let density = TriangleDensity::new(bvh);
        let mut splitter = PacketSplitter::new(rays.len());
        while let Some(range) = splitter.pop() {
            let as_packet = can_trace_packet(bvh, rays.coherence, range.len())
                && !density.are_shadow_rays_spread(rays, range.clone());
            if !as_packet {
                batch.trace_later::<S>(range, &mut streams);
                continue;
            }
            packet_transmittances.iter_mut().for_each(Transmittance::clear);
            let collect = A::COLLECTS_TRANSMITTANCE.then_some(&mut *packet_transmittances);
            let mut occlusion = PacketOcclusion::new(collect);
            let worlds_traced = packet::occluded::<S>(
                bvh.worlds(),
                rays,
                range.clone(),
                filter,
                &mut occlusion,
                &mut scratch.packet,
                &mut batch.tracer.stack,
            );
            if !worlds_traced {
                if !splitter.split(range.clone()) {
                    batch.trace_later::<S>(range, &mut streams);
                }
                continue;
            }
            if bvh.tlas.is_empty() {
                for (i, ray) in range.enumerate() {
                    let occluded = occlusion.is_occluded(i);
                    batch.out[ray] = A::new(occluded, occlusion.transmittance(i), t_max);
                }
            } else {
                let indices: Vec<u32> = range.map(|ray| ray as u32).collect();
                let mut occluded = [false; STREAM_RAYS];
                for (i, occluded) in occluded.iter_mut().enumerate().take(indices.len()) {
                    *occluded = occlusion.is_occluded(i);
                }
                let transmittances = A::COLLECTS_TRANSMITTANCE.then_some(&mut *packet_transmittances);
                batch.trace::<S>(&indices, &mut occluded, transmittances, true, &mut streams);
            }
        }
        let pending = streams.take_pending();
        batch.trace_pending::<S>(&pending, &mut streams);
        scratch.give_back();
    }
}

/// The rays of a batch that do not make packets.
struct StreamBatch<'a, 'b, A> {
    bvh: &'b SceneBvh,
    rays: &'a ShadowRayBatch,
    filter: &'a dyn HitFilter,
    out: &'a mut Vec<A>,
    t_max: f32,
    tracer: &'a mut SingleRayTracer<'b>,
    /// For each ray of a stream, if they are collected.
    transmittances: Vec<Transmittance>,
}

impl<A: ShadowRayAnswer> StreamBatch<'_, '_, A> {
    /// Traces rays together with others that make no packets.
    #[inline(always)]
    fn trace_later<S: Simd>(&mut self, range: Range<usize>, streams: &mut Streams) {
        if let Some(pending) = streams.push(range) {
            self.trace_pending::<S>(&pending, streams);
        }
    }

    /// Traces pending rays, and stores the answers.
    #[inline(always)]
    fn trace_pending<S: Simd>(&mut self, indices: &[u32], streams: &mut Streams) {
        let mut transmittances = std::mem::take(&mut self.transmittances);
        transmittances.iter_mut().for_each(Transmittance::clear);
        let collect = A::COLLECTS_TRANSMITTANCE.then_some(&mut *transmittances);
        self.trace::<S>(indices, &mut [false; STREAM_RAYS], collect, false, streams);
        self.transmittances = transmittances;
    }

    /// Traces rays, no more than a stream, and stores the answers. `occluded` says which are occluded by what packets have
    /// traced, and `worlds_traced` that this is the world BVHs.
    #[inline(always)]
    fn trace<S: Simd>(
        &mut self,
        indices: &[u32],
        occluded: &mut [bool; STREAM_RAYS],
        mut transmittance: Option<&mut [Transmittance]>,
        worlds_traced: bool,
        streams: &mut Streams,
    ) {
        let StreamBatch { bvh, rays, filter, t_max, .. } = *self;
        let mut query = AnyHitStream {
            rays,
            indices,
            filter,
            occluded: &mut *occluded,
            transmittance: transmittance.as_deref_mut(),
        };
        streams.trace::<S, _>(bvh, &mut query, worlds_traced, self.tracer);
        for (i, &ray) in indices.iter().enumerate() {
            let transmittance = transmittance.as_mut().map(|all| &mut all[i]);
            self.out[ray as usize] = A::new(occluded[i], transmittance, t_max);
        }
    }
}
