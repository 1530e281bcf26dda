//! Memory that packets are traced in, which a thread keeps from batch to batch.

use std::cell::Cell;

use crate::accel::packet::packet_traversal::PacketStack;
use crate::accel::packet::ray_packet::RayPacket;

/// A packet and its traversal stack, reused for all packets of a batch. It takes longer to clear than to load a packet, so
/// that threads keep it.
#[derive(Debug, Default)]
pub(crate) struct PacketScratch {
    pub(super) packet: RayPacket,
    pub(super) stack: PacketStack,
}

thread_local! {
    static KEPT: Cell<Option<Box<PacketScratch>>> = const { Cell::new(None) };
}

impl PacketScratch {
    /// Takes the memory of this thread.
    pub fn take() -> Box<PacketScratch> {
        KEPT.take().unwrap_or_default()
    }

    /// Gives it back.
    pub fn give_back(self: Box<PacketScratch>) {
        KEPT.set(Some(self));
    }
}
