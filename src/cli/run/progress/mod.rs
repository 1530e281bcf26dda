//! Messages and progress on standard error.

mod format;
mod image_monitor;
mod quiet;
mod reporter;
mod scene_log;
mod work_progress;

pub use image_monitor::ImageMonitor;
pub use quiet::quiet_reporter;
pub use reporter::Reporter;
pub use scene_log::SceneLog;
