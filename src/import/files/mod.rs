//! File access for importers: URIs, size limits, archives.

pub(crate) mod archive_hint;
pub(crate) mod data_uri;
pub(crate) mod git_lfs;
pub(crate) mod limits;
pub(crate) mod name_match;
pub(crate) mod read_file;
pub(crate) mod source_tracker;
pub(crate) mod uri;
