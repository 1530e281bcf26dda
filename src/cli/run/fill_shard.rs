//! Renders scenes into an archive, until no scene is left or one does not fit.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Error};

use super::batch::{Batch, Scenes, is_queue_full};
use super::full_disk::is_disk_full;
use crate::files::create_parent_folder;
use crate::plan::NumberedScene;
use crate::usage::UsageError;
use blinn_output::{ShardWriter, check_overwrite};

/// The images of scenes that were rendered before their archive was begun, by the number of the scene.
pub type EarlierImages = BTreeMap<usize, ShardWriter>;

/// A scene that did not fit into an archive, and its images.
pub type Overflow = Option<(NumberedScene, ShardWriter)>;

/// The reason why an archive was not written.
pub enum ShardFailure {
    /// The list of scenes cannot be read.
    Usage(UsageError),
    Archive(Error),
    /// The disk is full. The error was reported with its scene.
    DiskFull,
}

impl From<UsageError> for ShardFailure {
    fn from(error: UsageError) -> ShardFailure {
        ShardFailure::Usage(error)
    }
}

impl From<Error> for ShardFailure {
    fn from(error: Error) -> ShardFailure {
        ShardFailure::Archive(error)
    }
}

/// Renders the scenes of `list` into an archive, with `earlier` images at their places, and notes them in the ledger when the
/// archive is complete. Ends at the first scene with which it would have more than `max_bytes`, and returns that one; a
/// scene that is larger has an archive of its own.
pub fn fill_shard<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    file: &Path,
    max_bytes: Option<u64>,
    mut earlier: EarlierImages,
    list: &mut dyn Iterator<Item = Result<NumberedScene, UsageError>>,
) -> Result<Overflow, ShardFailure> {
    let cannot_be_written = || format!("{} cannot be written", file.display());
    check_overwrite(file, batch.plan.outputs.replace).map_err(Error::new)?;
    create_parent_folder(file)?;
    let mut shard = ShardWriter::new(file).with_context(cannot_be_written)?;
    let mut overflow = None;
    loop {
        while !is_queue_full(scenes)
            && let Some(scene) = list.next()
        {
            batch.start(scenes, scene?, Some(file));
        }
        let Some(finished) = scenes.next_finished() else { break };
        let scene = finished.job.scene.clone();
        let later = earlier.split_off(&scene.number);
        for images in std::mem::replace(&mut earlier, later).into_values() {
            shard.append(images).with_context(cannot_be_written)?;
        }
        let fits = |images: &ShardWriter| {
            shard.length() == 0
                || max_bytes.is_none_or(|max| shard.length().saturating_add(images.length()) <= max)
        };
        match batch.finish_scene(finished) {
            Ok(Some(images)) if fits(&images) => shard.append(images).with_context(cannot_be_written)?,
            Ok(Some(images)) => {
                overflow = Some((scene, images));
                break;
            }
            Err(error) if is_disk_full(&error) => return Err(ShardFailure::DiskFull),
            // A scene that fails has no images.
            Ok(None) | Err(_) => {}
        }
    }
    for images in earlier.into_values() {
        shard.append(images).with_context(cannot_be_written)?;
    }
    if shard.length() > 0 {
        shard.finish(batch.plan.outputs.replace).with_context(cannot_be_written)?;
        batch.reporter.wrote(None, file);
    }
    if let Some(ledger) = &mut batch.ledger {
        let appended = if overflow.is_some() { ledger.append_all_but_last() } else { ledger.append() };
        appended.context("--ledger")?;
    }
    Ok(overflow)
}
