//! Progress and cancellation of a render.

use std::sync::atomic::{AtomicBool, Ordering};

use blinn_core::cancellation::CancelToken;

/// Receives the progress of a render, and can cancel it.
pub trait ProgressMonitor: Sync {
    /// `count` more pixels are done.
    fn pixels_done(&self, count: u64) {
        let _ = count;
    }

    /// True ends the render early.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Ignores progress and never cancels.
impl ProgressMonitor for () {}

/// A flag that cancels.
impl ProgressMonitor for AtomicBool {
    fn is_cancelled(&self) -> bool {
        self.load(Ordering::Relaxed)
    }
}

/// A token that cancels.
impl ProgressMonitor for CancelToken {
    fn is_cancelled(&self) -> bool {
        CancelToken::is_cancelled(self)
    }
}

/// Passes on cancellation only.
pub(super) struct CancelOnly<'a>(pub &'a dyn ProgressMonitor);

impl ProgressMonitor for CancelOnly<'_> {
    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}
