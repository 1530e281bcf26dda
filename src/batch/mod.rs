//! Rendering of many frames or files: frame lists, output paths, fingerprints, pipelining and dataset cameras.

mod fingerprint;
mod frames;
mod path_template;
mod pipeline;
mod transforms;

pub use fingerprint::{FileDigests, SettingsHash, fingerprint};
pub use frames::{Chunk, FrameList, MAX_FRAMES};
pub use path_template::{PathTemplate, TemplateFields};
pub use pipeline::run_pipeline;
pub use transforms::{Dataset, DatasetView, WorldUp};
