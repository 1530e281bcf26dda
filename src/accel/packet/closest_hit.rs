//! Closest hits of a ray packet.

use std::ops::Range;

use glam::Vec3;

use crate::bvh::blas::Blas;
use crate::bvh::triangle_ids::TriangleIdMap;
use crate::bvh::triangle4::{TRIANGLE_LANES, Triangle4};
use crate::packet::exact_hits::{BLOCKS_PER_TABLE, ExactHits, GroupHits, compute_by_ray};
use crate::packet::packet_query::{CertainHit, PacketQuery};
use crate::packet::packet_traversal::PacketScratch;
use crate::packet::per_ray::{GROUPS_PER_QUAD, PerRay, RAYS_PER_GROUP};
use crate::packet::ray_packet::{RayPacket, pad_to_packet, prefetch_next_packet};
use crate::packet::shared_vector::SharedVector;
use crate::ray_batch::{Coherence, HitFilter, RayBatch};
use crate::traverse::bvh8_traversal::TraversalStack;
use crate::traverse::exact_triangle_test::LocalRay;
use crate::traverse::query::{ClosestHit, FilteredRay, RayQuery};
use blinn_core::geometry::{EPSILON, Hit, HitId};
use blinn_core::simd::{Lanes, Simd};

/// In [`ClosestHits::triangle_slot`]: the ray has hit nothing yet.
const NO_TRIANGLE: u32 = u32::MAX;
/// In [`ClosestHits::triangle_slot`]: the closest hit is in [`ClosestHits::hits`].
const EXACT: u32 = u32::MAX - 1;

/// Where the blocks of a table are hit by fewer rays than this, the hits that are left of a quad are computed ray by ray.
const MIN_RAYS_IN_TABLE: u32 = 24;

/// Finds the closest hits of the rays `range`, a packet at most, in the world BVHs. `hits` holds a miss for each of
/// them, and takes their hits. Returns false if the rays do not make a packet; `hits` may then have hits in some of
/// the BVHs.
#[inline(always)]
pub(crate) fn intersect<S: Simd>(
    worlds: [&Blas; 2],
    rays: &RayBatch,
    range: Range<usize>,
    filter: &dyn HitFilter,
    hits: &mut [Hit],
    scratch: &mut PacketScratch,
    single_ray_stack: &mut TraversalStack,
) -> bool {
    let PacketScratch { packet, stack } = scratch;
    let first = range.start;
    let count = range.len();
    let Some(shared) = load_rays::<S>(packet, rays, range.clone()) else { return false };
    if !(rays.t_max > 0.0) {
        return false;
    }
    packet.activate::<S>(count, rays.lower_bound().t, rays.t_max);
    if let Some(after) = rays.after.get(range) {
        let t_scale = packet.t_scale as f32;
        after.iter().enumerate().for_each(|(i, after)| packet.t_min.set(i, after.t * t_scale));
    }
    for (i, blas) in worlds.into_iter().filter(|blas| !blas.is_empty()).enumerate() {
        let mut triangle_slot = PerRay::splat(NO_TRIANGLE);
        if i > 0 {
            let known = |ray: usize| if hits[ray].is_miss() { NO_TRIANGLE } else { EXACT };
            (0..count).for_each(|ray| triangle_slot.set(ray, known(ray)));
        }
        let mut closest =
            ClosestHits { blas, rays, first, filter, triangle_slot, hits: &mut *hits, single_ray_stack };
        if !packet.trace::<S, _>(blas, &shared, &mut closest, stack) {
            return false;
        }
        closest.write_hits::<S>(packet, &shared);
    }
    true
}

/// Loads the rays of a packet. The shared origin or direction is taken from the batch, and so equal for all rays to the
/// bit.
#[inline(always)]
fn load_rays<S: Simd>(packet: &mut RayPacket, rays: &RayBatch, range: Range<usize>) -> Option<SharedVector> {
    prefetch_next_packet(match rays.coherence {
        Coherence::Direction(_) => rays.origins.get(range.end..),
        _ => rays.directions.get(range.end..),
    });
    let first = range.start;
    let count = range.len();
    let mut room = None;
    match rays.coherence {
        Coherence::Origin(o) => {
            let directions = pad_to_packet(&rays.directions[range], &mut room)?;
            let fits = packet.load_directions::<S>(o, directions, count, Vec3::ZERO);
            fits.then_some(SharedVector::Origin(o))
        }
        Coherence::Direction(_) => {
            let origins = pad_to_packet(&rays.origins[range], &mut room)?;
            packet.load_origins::<S>(rays.directions[first], origins, count).map(SharedVector::Direction)
        }
        Coherence::None => None,
    }
}

/// The closest hits of a packet in one BVH so far.
struct ClosestHits<'a, 's> {
    blas: &'a Blas,
    rays: &'a RayBatch,
    /// Index of the packet's first ray in the batch.
    first: usize,
    filter: &'a dyn HitFilter,
    /// The closest hit of each ray: [`NO_TRIANGLE`], [`EXACT`], or the slot of an unfiltered triangle
    /// ([`Blas::block_and_lane`]).
    triangle_slot: PerRay<u32>,
    /// The hits of rays that are [`EXACT`]; the others follow by [`ClosestHits::write_hits`].
    hits: &'s mut [Hit],
    single_ray_stack: &'s mut TraversalStack,
}

impl<'a> ClosestHits<'a, '_> {
    /// The origin and direction of a ray. A shared origin comes from the batch's header, not from far-off memory.
    #[inline(always)]
    fn filtered_ray(&self, ray: usize) -> FilteredRay<'a> {
        let i = self.first + ray;
        let o = match self.rays.coherence {
            Coherence::Origin(o) => o,
            _ => self.rays.origins[i],
        };
        FilteredRay { o, d: self.rays.directions[i], filter: self.filter }
    }

    #[inline(always)]
    fn local_ray(&self, ray: usize) -> Option<LocalRay> {
        let FilteredRay { o, d, .. } = self.filtered_ray(ray);
        LocalRay::new(o.as_dvec3(), d.as_dvec3())
    }

    /// Computes the closest hit of a ray so far.
    #[inline(always)]
    fn closest_hit(&self, ray: usize) -> Hit {
        match self.triangle_slot.get(ray) {
            NO_TRIANGLE => Hit { t: self.rays.t_max, id: HitId::NONE },
            EXACT => self.hits[ray],
            triangle_slot => {
                let (block, lane) = self.blas.block_and_lane(triangle_slot);
                let hit = self.local_ray(ray).and_then(|ray| ray.intersect_inside(&block.vertices(lane)));
                hit.map_or(Hit::MISS, |hit| Hit { t: hit.t, id: self.blas.ids.id(block.indices[lane]) })
            }
        }
    }

    fn query(&self, ray: usize) -> ClosestHit<'a> {
        ClosestHit {
            ray: self.filtered_ray(ray),
            cull_back_faces: self.rays.cull_back_faces,
            source: HitId::NONE,
            after: self.rays.after(self.first + ray),
            best: self.closest_hit(ray),
        }
    }

    /// Records the result of a query. Returns true if it is a new hit.
    fn record_query(&mut self, packet: &mut RayPacket, ray: usize, query: &ClosestHit) -> bool {
        let changed =
            !query.best.is_miss() && (self.triangle_slot.get(ray) != EXACT || self.hits[ray] != query.best);
        if changed {
            self.triangle_slot.set(ray, EXACT);
            self.hits[ray] = query.best;
            packet.set_t_max(ray, query.t_max());
        }
        changed
    }

    /// Computes the hits that are not [`EXACT`] yet, a quad at a time: neighbouring rays mostly hit the same few
    /// blocks.
    #[inline(always)]
    fn write_hits<S: Simd>(&mut self, packet: &RayPacket, shared: &SharedVector) {
        for (q, hits) in self.hits.chunks_mut(GROUPS_PER_QUAD * RAYS_PER_GROUP).enumerate().take(packet.quads)
        {
            let Some(mut pending) = PendingHits::new::<S>(self.blas, &self.triangle_slot.quads[q], hits)
            else {
                continue;
            };
            let mut table = ExactHits::new(shared);
            while pending.first_group < GROUPS_PER_QUAD {
                let in_table = pending.fill_table::<S>(&mut table);
                for (g, hits) in hits.chunks_mut(RAYS_PER_GROUP).enumerate().take(GROUPS_PER_QUAD) {
                    if in_table[g] != 0 {
                        let group_hits =
                            table.compute::<S>(packet, q * GROUPS_PER_QUAD + g, &pending.table_slots[g]);
                        write_group_hits::<S>(in_table[g], &group_hits, hits);
                    }
                }
                if in_table.iter().map(|rays| rays.count_ones()).sum::<u32>() >= MIN_RAYS_IN_TABLE {
                    continue;
                }
                for (g, hits) in hits.chunks_mut(RAYS_PER_GROUP).enumerate().take(GROUPS_PER_QUAD) {
                    let rays = pending.remaining[g];
                    if rays != 0 {
                        let slots = &pending.triangle_slots[g];
                        let group = q * GROUPS_PER_QUAD + g;
                        let group_hits = compute_by_ray(shared, packet, group, self.blas, slots, rays);
                        write_group_hits::<S>(rays, &group_hits, hits);
                    }
                }
                break;
            }
        }
    }
}

/// Certain hits in a quad whose t is still to be computed.
struct PendingHits<'a> {
    blocks: &'a [Triangle4],
    id_map: &'a TriangleIdMap,
    /// Slot of the triangle that each ray hits.
    triangle_slots: &'a [[u32; RAYS_PER_GROUP]; GROUPS_PER_QUAD],
    /// Rays that are left, by group.
    remaining: [u32; GROUPS_PER_QUAD],
    /// The first group with rays that are left.
    first_group: usize,
    /// Where the triangle of each ray is in the table, for rays that [`PendingHits::fill_table`] returned.
    table_slots: [[u32; RAYS_PER_GROUP]; GROUPS_PER_QUAD],
}

impl<'a> PendingHits<'a> {
    /// Finds the rays of a quad with a triangle slot. Returns `None` if there are none.
    #[inline(always)]
    fn new<S: Simd>(
        blas: &'a Blas,
        triangle_slots: &'a [[u32; RAYS_PER_GROUP]; GROUPS_PER_QUAD],
        hits: &[Hit],
    ) -> Option<Self> {
        let mut remaining = [0; GROUPS_PER_QUAD];
        let groups = hits.chunks(RAYS_PER_GROUP).zip(triangle_slots);
        for (remaining, (hits, triangle_slots)) in remaining.iter_mut().zip(groups) {
            *remaining = S::F32x16::lt_u32(triangle_slots, EXACT) & ((1 << hits.len()) - 1) as u32;
        }
        if remaining == [0; GROUPS_PER_QUAD] {
            return None;
        }
        Some(PendingHits {
            blocks: &blas.blocks,
            id_map: &blas.ids,
            triangle_slots,
            remaining,
            first_group: 0,
            table_slots: [[0; RAYS_PER_GROUP]; GROUPS_PER_QUAD],
        })
    }

    /// Fills the table with the next blocks that rays hit. Returns these rays, by group.
    #[inline(always)]
    fn fill_table<S: Simd>(&mut self, table: &mut ExactHits) -> [u32; GROUPS_PER_QUAD] {
        let mut in_table = [0; GROUPS_PER_QUAD];
        let mut block_count = 0;
        while self.first_group < GROUPS_PER_QUAD && block_count < BLOCKS_PER_TABLE {
            let rays = self.remaining[self.first_group];
            if rays == 0 {
                self.first_group += 1;
                continue;
            }
            let ray = rays.trailing_zeros() as usize & (RAYS_PER_GROUP - 1);
            let block = self.triangle_slots[self.first_group][ray] as usize / TRIANGLE_LANES;
            table.set_block(block_count, &self.blocks[block], self.id_map);
            let first_slot = (block * TRIANGLE_LANES) as u32;
            let first_in_table = (block_count * TRIANGLE_LANES) as u32;
            for (g, in_table) in in_table.iter_mut().enumerate().skip(self.first_group) {
                let triangle_slots = &self.triangle_slots[g];
                let out = &mut self.table_slots[g];
                let rays = S::F32x16::renumber_quad(triangle_slots, first_slot, first_in_table, out)
                    & self.remaining[g];
                self.remaining[g] &= !rays;
                *in_table |= rays;
            }
            block_count += 1;
        }
        in_table
    }
}

/// Writes the hits of the rays in `mask`.
#[inline(always)]
fn write_group_hits<S: Simd>(mask: u32, group_hits: &GroupHits, hits: &mut [Hit]) {
    let t = S::F32x16::load(&group_hits.t);
    let mut mask = mask & S::F32x16::splat(0.0).lt(t) & t.lt(S::F32x16::splat(f32::INFINITY));
    if mask == (1 << RAYS_PER_GROUP) - 1
        && let Some(hits) = hits.first_chunk_mut::<RAYS_PER_GROUP>()
    {
        let t = bytemuck::cast_ref(&group_hits.t);
        S::interleave3([t, &group_hits.instance, &group_hits.triangle], bytemuck::cast_mut(hits));
        return;
    }
    while mask != 0 {
        let i = mask.trailing_zeros() as usize & (RAYS_PER_GROUP - 1);
        if let Some(hit) = hits.get_mut(i) {
            let id = HitId { instance: group_hits.instance[i], triangle: group_hits.triangle[i] };
            *hit = Hit { t: group_hits.t[i], id };
        }
        mask &= mask - 1;
    }
}

impl<S: Simd> PacketQuery<S> for ClosestHits<'_, '_> {
    #[inline(always)]
    fn culls_back_faces(&self) -> bool {
        self.rays.cull_back_faces
    }

    #[inline(always)]
    fn unfiltered_mask(&self, block: &Triangle4) -> u8 {
        block.unfiltered_mask()
    }

    #[inline(always)]
    fn excluded_rays(&self, _: &Triangle4, _: usize, _: usize) -> u32 {
        0
    }

    #[inline(always)]
    fn record(
        &mut self,
        packet: &mut RayPacket,
        g: usize,
        mask: u32,
        triangle_slot: u32,
        hit: CertainHit<S::F32x16>,
    ) {
        let inv_det = hit.det.rcp();
        let t = |depth: S::F32x16, slack: f32| depth * inv_det * S::F32x16::splat(slack);
        let lower = t(hit.depth - hit.depth_error, 1.0 - 8.0 * EPSILON);
        let upper = t(hit.depth + hit.depth_error, 1.0 + 8.0 * EPSILON);
        let t_max_lower = packet.t_max_lower.group_mut(g);
        lower.select(mask, S::F32x16::load(t_max_lower)).store(t_max_lower);
        let t_max_upper = packet.t_max_upper.group_mut(g);
        upper.select(mask, S::F32x16::load(t_max_upper)).store(t_max_upper);
        S::F32x16::masked_fill(mask, self.triangle_slot.group_mut(g), triangle_slot);
    }

    fn test_exactly(&mut self, packet: &mut RayPacket, ray: usize, triangle_slot: u32, inside: bool) {
        let (block, lane) = self.blas.block_and_lane(triangle_slot);
        let hit = self.local_ray(ray).and_then(|ray| ray.intersect(&block.vertices(lane), inside));
        let Some(hit) = hit else { return };
        let mut query = self.query(ray);
        self.blas.report_hit(block, lane, hit, None, &mut query);
        self.record_query(packet, ray, &query);
    }

    #[inline(always)]
    fn trace_single(&mut self, packet: &mut RayPacket, ray: usize, child: u32) -> bool {
        let Some(local_ray) = self.local_ray(ray) else { return false };
        let mut query = self.query(ray);
        self.blas.traverse::<S, _>(child, &local_ray, None, &mut query, self.single_ray_stack);
        self.record_query(packet, ray, &query)
    }
}
