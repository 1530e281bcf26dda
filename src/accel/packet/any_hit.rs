//! Any hit of a ray packet: occlusion and transmittance of shadow rays.

use std::ops::Range;

use crate::bvh::blas::Blas;
use crate::bvh::triangle4::Triangle4;
use crate::packet::packet_query::{CertainHit, PacketQuery};
use crate::packet::packet_traversal::PacketScratch;
use crate::packet::per_ray::{GROUPS_PER_PACKET, PerRay, RAYS_PER_GROUP, RayMask};
use crate::packet::ray_packet::{RayPacket, pad_to_packet, prefetch_next_packet};
use crate::packet::shared_vector::SharedVector;
use crate::ray_batch::{Coherence, HitFilter, ShadowRayBatch};
use crate::single_ray_tracer::shadow_ray_query;
use crate::traverse::bvh8_traversal::TraversalStack;
use crate::traverse::conservative_triangle_test::LIGHT_MARGIN;
use crate::traverse::translucent_hits::Transmittance;
use blinn_core::simd::{Lanes, Simd};

/// The result of [`occluded`] for the rays of a packet.
#[derive(Debug)]
pub(crate) struct PacketOcclusion<'t> {
    occluded: RayMask,
    /// Collects the translucent surfaces on each ray; without it, they are ignored.
    transmittance: Option<&'t mut [Transmittance]>,
}

impl<'t> PacketOcclusion<'t> {
    /// A result without occluded rays.
    pub fn new(transmittance: Option<&'t mut [Transmittance]>) -> PacketOcclusion<'t> {
        PacketOcclusion { occluded: [0; GROUPS_PER_PACKET], transmittance }
    }

    /// Returns true if a ray is occluded.
    #[inline(always)]
    pub fn is_occluded(&self, ray: usize) -> bool {
        self.occluded[ray / RAYS_PER_GROUP] >> (ray % RAYS_PER_GROUP) & 1 == 1
    }

    /// The transmittance of a ray that is not occluded.
    #[inline(always)]
    pub fn transmittance(&mut self, ray: usize) -> Option<&mut Transmittance> {
        self.transmittance.as_mut().map(|transmittance| &mut transmittance[ray])
    }
}

/// Finds the rays of `range`, a packet at most, that are occluded in the world BVHs. Returns false if they do not
/// make a packet; `occlusion` may then have results of some of the BVHs.
#[inline(always)]
pub(crate) fn occluded<S: Simd>(
    worlds: [&Blas; 2],
    rays: &ShadowRayBatch,
    range: Range<usize>,
    filter: &dyn HitFilter,
    occlusion: &mut PacketOcclusion<'_>,
    scratch: &mut PacketScratch,
    single_ray_stack: &mut TraversalStack,
) -> bool {
    let PacketScratch { packet, stack } = scratch;
    let first = range.start;
    let Some(shared) = load_shadow_rays::<S>(packet, rays, range.clone()) else { return false };
    for blas in worlds.into_iter().filter(|blas| !blas.is_empty()) {
        let mut source = PerRay::splat(u32::MAX);
        let source_entries = source.quads.as_flattened_mut().as_flattened_mut();
        blas.ids.indices(&rays.source[range.clone()], source_entries);
        let mut any_hits =
            AnyHits { blas, rays, first, filter, source, occlusion: &mut *occlusion, single_ray_stack };
        if !packet.trace::<S, _>(blas, &shared, &mut any_hits, stack) {
            return false;
        }
    }
    true
}

/// Loads the rays of a packet. Those to a point light are traced from the light, and end at t = 1.
#[inline(always)]
fn load_shadow_rays<S: Simd>(
    packet: &mut RayPacket,
    rays: &ShadowRayBatch,
    range: Range<usize>,
) -> Option<SharedVector> {
    prefetch_next_packet(rays.from.get(range.end..));
    let count = range.len();
    let mut room = None;
    let from = pad_to_packet(&rays.from[range], &mut room)?;
    match rays.coherence {
        Coherence::Origin(light) => {
            if !packet.load_directions::<S>(light, from, count, light) {
                return None;
            }
            packet.activate::<S>(count, 0.0, 1.0);
            packet.certain_t_min = LIGHT_MARGIN * packet.t_scale as f32;
            Some(SharedVector::Origin(light))
        }
        Coherence::Direction(d) => {
            let d = packet.load_origins::<S>(d, from, count)?;
            packet.activate::<S>(count, 0.0, f32::INFINITY);
            Some(SharedVector::Direction(d))
        }
        Coherence::None => None,
    }
}

/// The occlusion of a packet of rays in one BVH so far.
struct AnyHits<'a, 't, 's, 'o> {
    blas: &'a Blas,
    rays: &'a ShadowRayBatch,
    /// Index of the packet's first ray in the batch.
    first: usize,
    filter: &'a dyn HitFilter,
    /// Index of the triangle that each ray starts on.
    source: PerRay<u32>,
    occlusion: &'o mut PacketOcclusion<'t>,
    single_ray_stack: &'s mut TraversalStack,
}

impl AnyHits<'_, '_, '_, '_> {
    fn set_occluded(&mut self, packet: &mut RayPacket, ray: usize) {
        packet.deactivate(ray);
        self.occlusion.occluded[ray / RAYS_PER_GROUP] |= 1 << (ray % RAYS_PER_GROUP);
    }
}

impl<S: Simd> PacketQuery<S> for AnyHits<'_, '_, '_, '_> {
    #[inline(always)]
    fn culls_back_faces(&self) -> bool {
        false
    }

    /// Shadow rays of a point light converge at the light; those of a directional light do so nowhere.
    #[inline(always)]
    fn visits_by_occlusion_priority(&self) -> bool {
        matches!(self.rays.coherence, Coherence::Direction(_))
    }

    #[inline(always)]
    fn unfiltered_mask(&self, block: &Triangle4) -> u8 {
        block.opaque_mask()
    }

    #[inline(always)]
    fn excluded_rays(&self, block: &Triangle4, lane: usize, g: usize) -> u32 {
        S::F32x16::eq_u32(self.source.group(g), block.indices[lane])
    }

    #[inline(always)]
    fn record(&mut self, packet: &mut RayPacket, g: usize, mask: u32, _: u32, _: CertainHit<S::F32x16>) {
        self.occlusion.occluded[g] |= mask;
        packet.active[g] &= !mask;
        let inactive = S::F32x16::splat(-1.0);
        for t_max in [packet.t_max_lower.group_mut(g), packet.t_max_upper.group_mut(g)] {
            inactive.select(mask, S::F32x16::load(t_max)).store(t_max);
        }
    }

    fn test_exactly(&mut self, packet: &mut RayPacket, ray: usize, triangle_slot: u32, inside: bool) {
        let (block, lane) = self.blas.block_and_lane(triangle_slot);
        let transmittance = self.occlusion.transmittance(ray);
        let (local_ray, mut query) =
            shadow_ray_query(self.rays, self.first + ray, self.filter, transmittance);
        let hit = local_ray.and_then(|ray| ray.intersect(&block.vertices(lane), inside));
        let Some(hit) = hit else { return };
        self.blas.report_hit(block, lane, hit, None, &mut query);
        if query.occluded {
            self.set_occluded(packet, ray);
        }
    }

    #[inline(always)]
    fn trace_single(&mut self, packet: &mut RayPacket, ray: usize, child: u32) -> bool {
        let transmittance = self.occlusion.transmittance(ray);
        let (local_ray, mut query) =
            shadow_ray_query(self.rays, self.first + ray, self.filter, transmittance);
        let Some(local_ray) = local_ray else { return false };
        self.blas.traverse::<S, _>(child, &local_ray, None, &mut query, self.single_ray_stack);
        let occluded = query.occluded;
        if occluded {
            self.set_occluded(packet, ray);
        }
        occluded
    }
}
