//! Bounds over the animation clip, with the time that they take in the log.

use std::time::Instant;

use crate::log::SessionLog;
use blinn_core::cancellation::Cancelled;
use blinn_scene::PosedScene;

/// Runs a function and logs the time for the bounds over the clip, if the function is the first that needs them.
///
/// # Errors
/// Computing the bounds was cancelled.
pub(crate) fn log_clip_bounds<T>(
    log: &dyn SessionLog,
    posed: &PosedScene,
    function: impl FnOnce() -> T,
) -> Result<T, Cancelled> {
    let since = Instant::now();
    let was_known = posed.clip_sample_count().is_some();
    let result = function();
    if let Some(times @ 1..) = posed.clip_sample_count().filter(|_| !was_known) {
        log.stage_since("clip", since, &format!("{times} times"));
    }
    posed.clip_bounds_cache().check().map(|()| result)
}
