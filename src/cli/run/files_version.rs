//! The version of the files that a scene's images went into, by which a ledger notices that another run replaced them.

use std::io;
use std::num::NonZeroU64;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crate::plan::{RenderPlan, Target};
use blinn_session::{PlannedFrame, SettingsHash};

/// A hash of the sizes and times of modification of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilesVersion(NonZeroU64);

impl FilesVersion {
    /// The version of the files for `frames` of the `index`-th scene, from 1. The files that describe all views
    /// of a dataset only have to exist: all tasks of a farm write them. `None` if a file is missing, or is standard
    /// output.
    pub fn of_scene(
        plan: &RenderPlan,
        path: &Path,
        index: usize,
        frames: &[PlannedFrame],
    ) -> Option<FilesVersion> {
        if frames.iter().any(|frame| plan.outputs.target(path, index, frame) == Target::Stdout) {
            return None;
        }
        let shared = plan.dataset_files(path, index);
        let files = plan.output_files(path, index, frames);
        let mut versions = Vec::with_capacity(files.len());
        for file in &files {
            let version = version_of(file).ok()?;
            if !shared.contains(file) {
                versions.push(version);
            }
        }
        Some(FilesVersion::from_hash(SettingsHash::of(&versions).hash() as u64))
    }

    fn from_hash(hash: u64) -> FilesVersion {
        FilesVersion(NonZeroU64::new(hash).unwrap_or(NonZeroU64::MAX))
    }

    /// Reads the digits of [`Display`](std::fmt::Display).
    pub fn from_digits(digits: &str) -> Option<FilesVersion> {
        u64::from_str_radix(digits, 16).ok().map(FilesVersion::from_hash)
    }
}

impl std::fmt::Display for FilesVersion {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

/// The size of a regular file and its time of modification.
fn version_of(file: &Path) -> io::Result<(u64, Option<(bool, Duration)>)> {
    let metadata = std::fs::metadata(file)?;
    if !metadata.is_file() {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    Ok((metadata.len(), metadata.modified().ok().map(time_of_epoch)))
}

/// Time since 1970, or before it if that is false.
pub fn time_of_epoch(time: SystemTime) -> (bool, Duration) {
    match time.duration_since(UNIX_EPOCH) {
        Ok(since) => (true, since),
        Err(before) => (false, before.duration()),
    }
}
