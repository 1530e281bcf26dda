//! Messages and progress on standard error.

mod format;
mod image_monitor;
mod message;
mod quiet;
mod reporter;
mod scene_log;
mod trace;
mod work_progress;
mod written_files;

pub use image_monitor::ImageMonitor;
pub use quiet::quiet_reporter;
pub use reporter::Reporter;
pub use scene_log::SceneLog;
pub use trace::Trace;
