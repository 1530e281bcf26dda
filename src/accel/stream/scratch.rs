//! Memory of streams, which a thread keeps from batch to batch.

use std::cell::Cell;

use crate::accel::stream::traversal::StreamMemory;

/// Memory for one stream at a time. It takes longer to clear than to trace a small batch in, so that threads keep it.
#[derive(Debug, Default)]
pub(crate) struct StreamScratch {
    /// For the world BVHs and the TLAS.
    pub(super) world: StreamMemory,
    /// For the frames of instances.
    pub(super) instance: Option<Box<StreamMemory>>,
    /// The rays of the world's stream that are in an instance's frame.
    pub(super) instance_rays: Vec<u32>,
}

thread_local! {
    static KEPT: Cell<Option<Box<StreamScratch>>> = const { Cell::new(None) };
}

impl StreamScratch {
    /// Takes the memory of this thread.
    pub fn take() -> Box<StreamScratch> {
        KEPT.take().unwrap_or_default()
    }

    /// Gives it back.
    pub fn give_back(self: Box<StreamScratch>) {
        KEPT.set(Some(self));
    }
}
