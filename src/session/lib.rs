//! Rendering of many frames or files: frame lists, output paths, fingerprints and pipelining.
#![deny(unsafe_code)]
#![warn(missing_docs)]

mod fingerprint;
mod frames;
mod path_list;
mod path_template;
mod pipeline;
mod scene_folder;

pub use fingerprint::{FileDigests, SettingsHash, fingerprint, is_marked_empty, mark_empty};
pub use frames::{Chunk, FrameList, MAX_FRAMES};
pub use path_list::{PathList, PathListBuilder, decode as decode_path};
pub use path_template::{PathTemplate, TemplateFields};
pub use pipeline::run_pipeline;
pub use scene_folder::{SCENE_EXTENSIONS, has_scene_extension, visit_scenes};
