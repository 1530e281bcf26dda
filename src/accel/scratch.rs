//! Memory that rays are traced in, which a thread keeps from batch to batch.

use std::cell::Cell;

use crate::packet::PacketScratch;
use crate::stream::StreamScratch;

/// Memory for packets and streams. It takes longer to clear than to trace a small batch in, so that threads keep it.
#[derive(Debug, Default)]
pub(crate) struct TraceScratch {
    pub packet: PacketScratch,
    /// Allocated for the first stream.
    pub stream: Option<Box<StreamScratch>>,
}

thread_local! {
    static KEPT: Cell<Option<Box<TraceScratch>>> = const { Cell::new(None) };
}

impl TraceScratch {
    /// Takes the memory of this thread.
    pub fn take() -> Box<TraceScratch> {
        KEPT.take().unwrap_or_default()
    }

    /// Gives the memory back to this thread.
    pub fn give_back(self: Box<TraceScratch>) {
        KEPT.set(Some(self));
    }
}
