//! The shared origin or direction of a packet, and the start of its traversal.

use glam::Vec3;

use crate::bvh::blas::Blas;
use crate::bvh::bvh8::Octant;
use crate::packet::group_bounds::GroupBounds;
use crate::packet::packet_query::PacketQuery;
use crate::packet::packet_traversal::{PacketStack, TraversePacketKernel};
use crate::packet::ray_packet::RayPacket;
use crate::packet::shared_direction::SharedDirection;
use crate::packet::shared_origin::SharedOrigin;
use crate::traverse::error_bounds::EdgeFunctionBounds;
use blinn_core::simd::Simd;

/// The origin or direction that the rays of a packet share. Directions are divided by the packet's `t_scale`.
#[derive(Clone, Copy, Debug)]
pub(super) enum SharedVector {
    Origin(Vec3),
    Direction(Vec3),
}

impl RayPacket {
    /// Traces the packet through a BVH. Returns false, without any hits, where its rays spread too far.
    #[inline(always)]
    pub fn trace<S: Simd, H: PacketQuery<S>>(
        &mut self,
        blas: &Blas,
        shared: &SharedVector,
        hits: &mut H,
        stack: &mut PacketStack,
    ) -> bool {
        match *shared {
            SharedVector::Origin(o) => {
                let frustum = &self.frustum;
                let max_distance = o.as_dvec3().distance(blas.centre) + blas.radius;
                let kind = SharedOrigin {
                    o,
                    projection: frustum.projection,
                    min_inv_major: frustum.min_inv_major,
                    bounds: EdgeFunctionBounds::new(frustum.max_length(), max_distance, 0.0),
                    near_sides: frustum.near_sides(),
                };
                let bounds = GroupBounds::of_directions::<S>(self);
                let octant = Octant::of(frustum.mean);
                S::call_outlined(TraversePacketKernel {
                    packet: self,
                    blas,
                    kind: &kind,
                    bounds: &bounds,
                    octant,
                    hits,
                    stack,
                });
            }
            SharedVector::Direction(d) => {
                let max_coordinate = blas.max_coordinate();
                let radius = blas.radius;
                let Some(bounds) = GroupBounds::of_origins::<S>(self, d, max_coordinate, radius as f32)
                else {
                    return false;
                };
                let max_distance = self.max_origin_distance::<S>(blas.centre) + radius;
                let kind = SharedDirection::new(d, max_distance, self.max_coordinate.max(max_coordinate));
                S::call_outlined(TraversePacketKernel {
                    packet: self,
                    blas,
                    kind: &kind,
                    bounds: &bounds,
                    octant: Octant::of(d),
                    hits,
                    stack,
                });
            }
        }
        true
    }
}
