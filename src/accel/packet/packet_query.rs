//! Handling of hits in packet traversal: keep the closest ([`closest_hit`]) or end the ray ([`any_hit`]).
//!
//! [`closest_hit`]: crate::packet::closest_hit
//! [`any_hit`]: crate::packet::any_hit

use crate::bvh::triangle4::Triangle4;
use crate::packet::ray_packet::RayPacket;
use blinn_core::simd::Simd;

/// Receives the hits of a packet.
pub(super) trait PacketQuery<S: Simd> {
    /// True if back faces of single-sided triangles are culled.
    fn culls_back_faces(&self) -> bool;

    /// True if children are visited by occlusion priority instead of front to back.
    fn visits_by_occlusion_priority(&self) -> bool {
        false
    }

    /// Returns the triangles of a block whose certain hits are recorded without the exact test.
    fn unfiltered_mask(&self, block: &Triangle4) -> u8;

    /// Returns the rays of group `g` that cannot hit triangle `lane` of a block.
    fn excluded_rays(&self, block: &Triangle4, lane: usize, g: usize) -> u32;

    /// Records certain hits of an unfiltered triangle by the rays `mask` of group `g`, each closer than all hits that its
    /// ray has had so far.
    fn record(
        &mut self,
        packet: &mut RayPacket,
        g: usize,
        mask: u32,
        triangle_slot: u32,
        hit: CertainHit<S::F32x16>,
    );

    /// Takes the exact test of a ray and a triangle. If `inside`, its line is known to pass through the triangle,
    /// and not at a grazing angle.
    fn test_exactly(&mut self, packet: &mut RayPacket, ray: usize, triangle_slot: u32, inside: bool);

    /// Traces a single ray through the BVH below `child`. Returns true if that found a hit.
    fn trace_single(&mut self, packet: &mut RayPacket, ray: usize, child: u32) -> bool;
}

/// Certain hits at t = (depth ± depth_error)/det.
#[derive(Clone, Copy)]
pub(super) struct CertainHit<L> {
    pub depth: L,
    pub depth_error: L,
    pub det: L,
}
