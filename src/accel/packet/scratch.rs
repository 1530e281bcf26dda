//! Memory that packets of a batch are traced in, one after the other.

use crate::accel::packet::packet_traversal::PacketStack;
use crate::accel::packet::ray_packet::RayPacket;

/// A packet and its traversal stack, reused for all packets of a batch.
#[derive(Debug, Default)]
pub(crate) struct PacketScratch {
    pub(super) packet: RayPacket,
    pub(super) stack: PacketStack,
}
