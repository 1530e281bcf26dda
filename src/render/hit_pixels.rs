//! Counts the pixels that show a surface.

use std::sync::atomic::{AtomicU64, Ordering};

use glam::UVec2;
use rayon::prelude::*;

use crate::integrator::{Frame, Sample, Scratch, have_hits};
use crate::progress::ProgressMonitor;
use crate::settings::RenderSettings;
use blinn_core::cancellation::Cancelled;

/// Returns the number of pixels with a surface at their centre, as the mask of [`render_aovs`](crate::render_aovs) has it, or
/// `limit` if there are more. Rows are skipped once there are as many.
///
/// # Errors
/// [`Cancelled`] if `monitor` cancels.
pub fn count_hit_pixels(
    frame: &Frame,
    settings: &RenderSettings,
    limit: u64,
    monitor: &dyn ProgressMonitor,
) -> Result<u64, Cancelled> {
    let window = settings.window();
    let count = AtomicU64::new(0);
    (window.y..window.y + window.height).into_par_iter().for_each_init(Scratch::default, |scratch, y| {
        if count.load(Ordering::Relaxed) >= limit || monitor.is_cancelled() {
            return;
        }
        let columns = window.x..window.x + window.width;
        let samples: Vec<Sample> = columns.map(|x| settings.centre_sample(UVec2::new(x, y))).collect();
        let hits = have_hits(frame, &samples, scratch).into_iter().filter(|&hit| hit).count();
        count.fetch_add(hits as u64, Ordering::Relaxed);
    });
    if monitor.is_cancelled() { Err(Cancelled) } else { Ok(count.into_inner().min(limit)) }
}
