//! Messages about a scene.

use std::path::PathBuf;
use std::time::Duration;

/// A message about a scene.
pub enum Message {
    Warning(String),
    /// A remark that helps.
    Hint(String),
    /// A choice, for --verbose.
    Note(String),
    /// The time of a stage, for --perf.
    Stage {
        name: String,
        time: Duration,
        detail: String,
    },
    /// Bytes of memory that the scene is expected to need, for --perf.
    Estimate(u64),
    /// A file that was written.
    Wrote {
        file: PathBuf,
        /// True for an image that shows nothing.
        is_empty: bool,
    },
    /// The number of images that --resume keeps.
    Kept(usize),
    /// An image that shows nothing.
    Empty,
    /// The number of images that are rendered.
    Frames(usize),
}
