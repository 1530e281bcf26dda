//! Any-hit tracing of a ray packet: occlusion and transmittance of segments.

use std::ops::Range;

use crate::accel::bvh::blas::Blas;
use crate::accel::bvh::triangle4::Triangle4;
use crate::accel::packet::packet_query::{CertainHit, PacketQuery};
use crate::accel::packet::per_ray::{GROUPS_PER_PACKET, PerRay, RAYS_PER_GROUP, RayMask};
use crate::accel::packet::ray_packet::{RayPacket, pad_to_packet, prefetch_next_packet};
use crate::accel::packet::scratch::PacketScratch;
use crate::accel::packet::shared_vector::SharedVector;
use crate::accel::ray_batch::{Coherence, HitFilter, ShadowRayBatch};
use crate::accel::single_ray_tracer::shadow_ray_query;
use crate::accel::traverse::bvh8_traversal::TraversalStack;
use crate::accel::traverse::conservative_triangle_test::LIGHT_MARGIN;
use crate::accel::traverse::translucent_hits::Transmittance;
use crate::simd::{Lanes, Simd};

/// The result of [`occluded`] for the segments of a packet.
#[derive(Debug)]
pub(crate) struct PacketOcclusion<'t> {
    occluded: RayMask,
    /// Collects the translucent surfaces on each segment; without it, they are ignored.
    transmittance: Option<&'t mut [Transmittance]>,
}

impl<'t> PacketOcclusion<'t> {
    /// A result without occluded segments.
    pub fn new(transmittance: Option<&'t mut [Transmittance]>) -> PacketOcclusion<'t> {
        PacketOcclusion { occluded: [0; GROUPS_PER_PACKET], transmittance }
    }

    /// Forgets the translucent surfaces, to collect them again.
    pub fn clear_transmittance(&mut self) {
        self.transmittance.iter_mut().flat_map(|all| all.iter_mut()).for_each(Transmittance::clear);
    }

    /// Returns true where a segment is occluded.
    #[inline(always)]
    pub fn is_occluded(&self, segment: usize) -> bool {
        self.occluded[segment / RAYS_PER_GROUP] >> (segment % RAYS_PER_GROUP) & 1 == 1
    }

    /// The transmittance of a segment that is not occluded.
    #[inline(always)]
    pub fn transmittance(&mut self, segment: usize) -> Option<&mut Transmittance> {
        self.transmittance.as_mut().map(|transmittance| &mut transmittance[segment])
    }
}

/// Finds the segments of `range`, a packet at most, that are occluded in the world BVHs. Returns false where they do not
/// make a packet; some of the BVHs may have been traversed then.
#[inline(always)]
pub(crate) fn occluded<S: Simd>(
    worlds: &[Blas],
    segments: &ShadowRayBatch,
    range: Range<usize>,
    filter: &dyn HitFilter,
    occlusion: &mut PacketOcclusion<'_>,
    scratch: &mut PacketScratch,
    single_ray_stack: &mut TraversalStack,
) -> bool {
    let PacketScratch { packet, stack } = scratch;
    let first = range.start;
    let Some(shared) = load_segments::<S>(packet, segments, range.clone()) else { return false };
    for blas in worlds.iter().filter(|blas| !blas.is_empty()) {
        let mut source = PerRay::splat(u32::MAX);
        let source_entries = source.quads.as_flattened_mut().as_flattened_mut();
        blas.ids.indices(&segments.source[range.clone()], source_entries);
        let mut any_hits =
            AnyHits { blas, segments, first, filter, source, occlusion: &mut *occlusion, single_ray_stack };
        if !packet.trace::<S, _>(blas, &shared, &mut any_hits, stack) {
            return false;
        }
    }
    true
}

/// Loads the segments of a packet. Segments to a point light are traced from the light, and end at t = 1.
#[inline(always)]
fn load_segments<S: Simd>(
    packet: &mut RayPacket,
    segments: &ShadowRayBatch,
    range: Range<usize>,
) -> Option<SharedVector> {
    prefetch_next_packet(segments.from.get(range.end..));
    let count = range.len();
    let mut room = None;
    let from = pad_to_packet(&segments.from[range], &mut room)?;
    match segments.coherence {
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

/// The occlusion of a packet of segments in one BVH so far.
struct AnyHits<'a, 't, 's, 'o> {
    blas: &'a Blas,
    segments: &'a ShadowRayBatch,
    /// Index of the packet's first segment in the batch.
    first: usize,
    filter: &'a dyn HitFilter,
    /// Index of the triangle that each segment starts on.
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
        matches!(self.segments.coherence, Coherence::Direction(_))
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

    fn test_exactly(&mut self, packet: &mut RayPacket, ray: usize, entry: u32, certain: bool) {
        let (block, lane) = self.blas.locate(entry);
        let transmittance = self.occlusion.transmittance(ray);
        let (local_ray, mut query) =
            shadow_ray_query(self.segments, self.first + ray, self.filter, transmittance);
        let hit = local_ray.and_then(|ray| ray.intersect(&block.vertices(lane), certain));
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
            shadow_ray_query(self.segments, self.first + ray, self.filter, transmittance);
        let Some(local_ray) = local_ray else { return false };
        self.blas.traverse::<S, _>(child, &local_ray, None, &mut query, self.single_ray_stack);
        let occluded = query.occluded;
        if occluded {
            self.set_occluded(packet, ray);
        }
        occluded
    }
}
