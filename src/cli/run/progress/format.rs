//! The line beside the progress bar: what is rendered, how fast, and the time left.

use std::path::Path;
use std::time::Duration;

use super::work_progress::WorkProgress;
use crate::console::single_line;

/// Time after which the time left is shown. Earlier estimates jump.
const FIRST_ESTIMATE: Duration = Duration::from_secs(2);

/// Describes the current frame of the scene of a number.
pub fn progress_line(progress: &WorkProgress, number: usize, scene: &Path) -> String {
    let name = scene.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let mut parts = vec![single_line(&name)];
    let scenes = progress.scene();
    let frames = progress.frame(number);
    if scenes.count > 1 {
        parts.push(format!("scene {}/{}", scenes.current, scenes.count));
    }
    if frames.count > 1 {
        parts.push(format!("frame {}/{}", frames.current, frames.count));
    }
    if let Some(rate) = progress.frames_per_second().filter(|_| scenes.count * frames.count > 1) {
        parts.push(format!("{rate:.2} frames/s"));
    }
    if let Some(left) = progress.time_left().filter(|_| progress.elapsed() >= FIRST_ESTIMATE) {
        parts.push(format!("{} left", clock(left)));
    }
    parts.join(", ")
}

/// `m:ss` or `h:mm:ss`.
fn clock(time: Duration) -> String {
    let s = time.as_secs();
    match s / 3600 {
        0 => format!("{}:{:02}", s / 60, s % 60),
        hours => format!("{hours}:{:02}:{:02}", s / 60 % 60, s % 60),
    }
}
