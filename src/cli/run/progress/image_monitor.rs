//! Progress of one image, by its finished pixels.

use std::sync::atomic::{AtomicU64, Ordering};

use super::scene_log::SceneLog;
use blinn_core::cancellation::CancelToken;
use blinn_render::ProgressMonitor;

/// Adds the progress of an image to that of all work.
pub struct ImageMonitor<'r> {
    log: &'r SceneLog<'r>,
    pixels: u64,
    pixels_done: AtomicU64,
    cancel: &'r CancelToken,
}

impl<'r> ImageMonitor<'r> {
    /// Monitors an image of `pixels` pixels, which `cancel` ends.
    pub fn new(log: &'r SceneLog<'r>, pixels: u64, cancel: &'r CancelToken) -> ImageMonitor<'r> {
        ImageMonitor { log, pixels, pixels_done: AtomicU64::new(0), cancel }
    }

    /// The image is rendered.
    pub fn finish(self) {
        self.log.frame_done();
    }
}

impl ProgressMonitor for ImageMonitor<'_> {
    fn pixels_done(&self, count: u64) {
        let done = self.pixels_done.fetch_add(count, Ordering::Relaxed) + count;
        self.log.frame_progress(done as f64 / self.pixels.max(1) as f64);
    }

    fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }
}
