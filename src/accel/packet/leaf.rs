//! Intersection of a packet with the triangles of a leaf.

use crate::bvh::triangle4::{TRIANGLE_LANES, Triangle4};
use crate::packet::group_bounds::{GroupBounds, LinearFunction};
use crate::packet::packet_kind::PacketKind;
use crate::packet::packet_query::{CertainHit, PacketQuery};
use crate::packet::per_ray::{GROUPS_PER_PACKET, GROUPS_PER_QUAD, QUADS_PER_PACKET, RAYS_PER_GROUP};
use crate::packet::prepared_triangles::PreparedTriangles;
use crate::packet::ray_packet::RayPacket;
use crate::traverse::error_bounds::{BlockErrorBounds, W_SCALE};
use blinn_core::simd::{Lanes, Simd};

/// A block prepared for a packet.
struct PreparedBlock<'a, S: Simd, K> {
    block: &'a Triangle4,
    /// Slot of the block's first triangle.
    first_slot: usize,
    kind: &'a K,
    bounds: &'a GroupBounds<S::F32x16>,
    triangles: &'a PreparedTriangles,
    /// Error bound of the edge functions.
    error: S::F32x16,
    /// −`error`.
    negative_error: S::F32x16,
    depth_error: S::F32x16,
    /// The sign of a determinant is certain beyond this.
    min_determinant: S::F32x16,
    projected_edge_functions: [LinearFunction<S::F32x16>; 3],
    projected_error: f32,
}

/// The rays of a group that may hit a triangle, as masks.
struct RayCandidates<L> {
    /// Rays whose hit can be recorded without the exact test: they certainly hit an unfiltered triangle, nearer than all
    /// that they have hit so far.
    recordable: u32,
    /// Other rays that may hit it: they need the exact test.
    uncertain: u32,
    /// Rays whose line certainly passes through the triangle, and not at a grazing angle.
    inside: u32,
    hit: CertainHit<L>,
}

impl RayPacket {
    /// Intersects the rays of `groups` with the leaf that begins at block `first`. Returns the groups in which anything
    /// changed.
    #[inline(always)]
    pub fn intersect_leaf<S: Simd, K: PacketKind<S>>(
        &mut self,
        blocks: &[Triangle4],
        first: u32,
        groups: u32,
        kind: &K,
        bounds: &GroupBounds<S::F32x16>,
        hits: &mut impl PacketQuery<S>,
    ) -> u32 {
        let mut changed = 0;
        for (index, block) in blocks.iter().enumerate().skip(first as usize) {
            let triangles = kind.prepare(block);
            let first_slot = index * TRIANGLE_LANES;
            let prepared = PreparedBlock::<S, K>::new(block, first_slot, kind, bounds, &triangles);
            changed |= prepared.intersect(self, groups, hits);
            if block.is_last_in_leaf() {
                break;
            }
        }
        changed
    }
}

impl<'a, S: Simd, K: PacketKind<S>> PreparedBlock<'a, S, K> {
    #[inline(always)]
    fn new(
        block: &'a Triangle4,
        first_slot: usize,
        kind: &'a K,
        bounds: &'a GroupBounds<S::F32x16>,
        triangles: &'a PreparedTriangles,
    ) -> Self {
        let BlockErrorBounds { edge_function, depth, min_determinant } = kind.error_bounds(block);
        PreparedBlock {
            block,
            first_slot,
            kind,
            bounds,
            triangles,
            error: S::F32x16::splat(edge_function),
            negative_error: S::F32x16::splat(-edge_function),
            depth_error: S::F32x16::splat(depth),
            min_determinant: S::F32x16::splat(min_determinant),
            projected_edge_functions: kind.projected_edge_functions(triangles),
            projected_error: kind.projected_error(block),
        }
    }

    /// Intersects the rays of `groups` with the triangles. Returns the groups in which anything changed.
    #[inline(always)]
    fn intersect(&self, packet: &mut RayPacket, groups: u32, hits: &mut impl PacketQuery<S>) -> u32 {
        let mut changed = 0;
        let mut missed = 0;
        let mut quad = usize::MAX;
        let mut remaining = groups;
        while remaining != 0 {
            let g = remaining.trailing_zeros() as usize % GROUPS_PER_PACKET;
            remaining &= remaining - 1;
            if g / GROUPS_PER_QUAD != quad {
                quad = g / GROUPS_PER_QUAD;
                let edge_functions = &self.projected_edge_functions;
                missed = self.bounds.missed_triangles(
                    quad % QUADS_PER_PACKET,
                    edge_functions,
                    self.projected_error,
                );
            }
            if packet.active[g] == 0 {
                continue;
            }
            let triangles = self.block.lane_mask() & !(missed >> (g % GROUPS_PER_QUAD * TRIANGLE_LANES));
            changed |= u32::from(self.intersect_group(packet, g, triangles, hits)) << g;
        }
        changed
    }

    /// Intersects the rays of group `g` with some of the triangles. Returns true if anything changed.
    #[inline(always)]
    fn intersect_group(
        &self,
        packet: &mut RayPacket,
        g: usize,
        mut triangles: u32,
        hits: &mut impl PacketQuery<S>,
    ) -> bool {
        let mut changed = false;
        while triangles != 0 {
            let lane = triangles.trailing_zeros() as usize % TRIANGLE_LANES;
            triangles &= triangles - 1;
            let Some(rays) = self.candidates(packet, g, lane, hits) else { continue };
            changed = true;
            let triangle_slot = (self.first_slot + lane) as u32;
            if rays.recordable != 0 {
                hits.record(packet, g, rays.recordable, triangle_slot, rays.hit);
            }
            let mut uncertain = rays.uncertain;
            while uncertain != 0 {
                let ray = uncertain.trailing_zeros() as usize;
                hits.test_exactly(
                    packet,
                    g * RAYS_PER_GROUP + ray,
                    triangle_slot,
                    rays.inside >> ray & 1 == 1,
                );
                uncertain &= uncertain - 1;
            }
        }
        changed
    }

    /// Tests the rays of group `g` against a triangle. Returns `None` where all certainly miss it.
    #[inline(always)]
    fn candidates(
        &self,
        packet: &RayPacket,
        g: usize,
        lane: usize,
        hits: &impl PacketQuery<S>,
    ) -> Option<RayCandidates<S::F32x16>> {
        let edge_functions = self.kind.edge_functions(packet, g, self.triangles, lane);
        let u = edge_functions.u;
        let v = edge_functions.v;
        let w = (edge_functions.det - u - v) * S::F32x16::splat(W_SCALE);
        let min = u.min(v).min(w);
        let max = u.max(v).max(w);
        // NaN compares false and stays possible.
        let outside = min.lt(self.negative_error) & self.error.lt(max);
        let mut possible = packet.active[g] & !outside;
        if possible == 0 {
            return None;
        }
        let det = edge_functions.det.abs();
        let depth = edge_functions.depth.xor_sign(edge_functions.det);
        let sign_is_certain = self.min_determinant.lt(det);
        if hits.culls_back_faces() {
            possible &= !(self.back_faces(lane, edge_functions.det) & sign_is_certain);
        }
        possible &= !hits.excluded_rays(self.block, lane, g);
        let t_min = S::F32x16::load(packet.t_min.group(g));
        let inside = sign_is_certain & (self.error.lt(min) | max.lt(self.negative_error));
        let depth_min = depth - self.depth_error;
        let depth_max = depth + self.depth_error;
        let is_closest = depth_max.lt(S::F32x16::load(packet.t_max_lower.group(g)) * det)
            & (t_min.max(S::F32x16::splat(packet.certain_t_min)) * det).lt(depth_min);
        // All rays or none: −1 has all bits.
        let unfiltered = u32::from(hits.unfiltered_mask(self.block) >> lane & 1).wrapping_neg();
        let recordable = possible & inside & is_closest & unfiltered;
        let mut uncertain = possible & !recordable;
        if uncertain != 0 {
            let t_max = S::F32x16::load(packet.t_max_upper.group(g));
            let out_of_range = (t_max * det).lt(depth_min) | depth_max.lt(t_min * det);
            uncertain &= !(out_of_range & sign_is_certain);
        }
        if recordable | uncertain == 0 {
            return None;
        }
        let hit = CertainHit { depth, depth_error: self.depth_error, det };
        Some(RayCandidates { recordable, uncertain, inside, hit })
    }

    /// Returns the rays that meet the back of a single-sided triangle. `det` are their determinants.
    #[inline(always)]
    fn back_faces(&self, lane: usize, det: S::F32x16) -> u32 {
        let flags = self.block.flags(lane);
        if !flags.single_sided {
            return 0;
        }
        let ccw = det.lt(S::F32x16::splat(0.0));
        if flags.reversed { ccw } else { !ccw }
    }
}
