//! File access of the importers: references of a scene, size limits, data URIs and checks for archives.

pub(crate) mod data_uri;
pub(crate) mod escape;
pub(crate) mod foreign_format;
pub(crate) mod git_lfs;
pub(crate) mod limits;
pub(crate) mod name_match;
pub(crate) mod read_file;
mod reference;
pub(crate) mod scene_folder;
pub(crate) mod scene_input;
pub(crate) mod source_tracker;
pub(crate) mod tar_archive;
