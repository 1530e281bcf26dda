//! The operations that depend on what the rays of a packet share.

use crate::bvh::bvh8::Bvh8Node;
use crate::bvh::triangle4::Triangle4;
use crate::packet::group_bounds::{LinearFunction, ProjectedBoxes};
use crate::packet::prepared_triangles::{EdgeFunctions, PreparedTriangles};
use crate::packet::ray_packet::RayPacket;
use crate::traverse::error_bounds::BlockErrorBounds;
use blinn_core::simd::Simd;

/// The planes of a box by axis and side, in the form that the packet kind tests.
pub(super) type BoxPlanes = [[f32; 2]; 3];

/// A kind of packet: [`SharedOrigin`] or [`SharedDirection`].
///
/// [`SharedOrigin`]: crate::packet::shared_origin::SharedOrigin
/// [`SharedDirection`]: crate::packet::shared_direction::SharedDirection
pub(super) trait PacketKind<S: Simd> {
    /// Projects the boxes of a node's children onto the plane across the rays.
    fn project_children(&self, node: &Bvh8Node) -> ProjectedBoxes<S::F32x8>;

    /// Prepares the box of a child for [`PacketKind::intersect_box`].
    fn box_planes(&self, node: &Bvh8Node, slot: usize) -> BoxPlanes;

    /// Returns a bit for each ray of group `g` that enters a box.
    fn intersect_box(&self, packet: &RayPacket, g: usize, planes: &BoxPlanes) -> u32;

    /// Computes what the edge functions of a block's triangles have in common for all rays.
    fn prepare(&self, block: &Triangle4) -> PreparedTriangles;

    /// Returns bounds on the rounding errors of [`PacketKind::edge_functions`].
    fn error_bounds(&self, block: &Triangle4) -> BlockErrorBounds;

    /// Returns the edge functions of a block's triangles on the projection plane, up to a common sign, repeated for the
    /// four groups of a quad.
    fn projected_edge_functions(&self, prepared: &PreparedTriangles) -> [LinearFunction<S::F32x16>; 3];

    /// Returns a bound on the rounding error of [`PacketKind::projected_edge_functions`].
    fn projected_error(&self, block: &Triangle4) -> f32;

    /// Evaluates the edge functions of triangle `lane` for the rays of group `g`.
    fn edge_functions(
        &self,
        packet: &RayPacket,
        g: usize,
        prepared: &PreparedTriangles,
        lane: usize,
    ) -> EdgeFunctions<S::F32x16>;
}
