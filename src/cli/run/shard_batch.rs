//! Archives of a number of images: which scenes share one is known before they are rendered.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::archived_scenes::archived_scenes;
use super::batch::{Batch, Scenes, fail, is_queue_full};
use super::fill_shard::{EarlierImages, ShardFailure, fill_shard};
use super::full_disk::is_disk_full;
use super::ledger::PastOutcome;
use crate::console::print_stdout;
use crate::plan::{NumberedScene, ShardPlan};
use crate::usage::UsageError;

/// Renders scenes into archives. With --resume, archives that are up to date are kept, and all others are made anew. Of an
/// archive that lacks only scenes that failed, these alone are rendered again, and the others if one of them succeeds.
pub fn render_shards<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    shards: &ShardPlan,
    list: impl Iterator<Item = Result<NumberedScene, UsageError>>,
) -> Result<(), UsageError> {
    let mut group: Vec<NumberedScene> = Vec::new();
    for scene in list {
        let scene = scene?;
        let is_next =
            group.first().is_some_and(|first| shards.file(first.number) != shards.file(scene.number));
        if is_next {
            let is_full = render_shard(batch, scenes, &shards.file(group[0].number), &group)?;
            group.clear();
            if is_full {
                batch.summary.not_started = batch.plan.scene_range().end + 1 - scene.number;
                return Ok(());
            }
        }
        group.push(scene);
    }
    if let Some(first) = group.first() {
        render_shard(batch, scenes, &shards.file(first.number), &group)?;
    }
    Ok(())
}

/// Renders the scenes of one archive, and reports its errors. Returns true if the disk is full.
fn render_shard<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    file: &Path,
    list: &[NumberedScene],
) -> Result<bool, UsageError> {
    if batch.plan.dry_run {
        let printed = print_stdout(format!("{}\n", file.display()).as_bytes());
        return Ok(printed.is_err_and(|error| is_disk_full(&error)));
    }
    let Err(failure) = complete_shard(batch, scenes, file, list) else { return Ok(false) };
    drop(scenes.cancel());
    if let Some(ledger) = &mut batch.ledger {
        ledger.discard();
    }
    match failure {
        ShardFailure::Usage(error) => Err(error),
        ShardFailure::DiskFull => Ok(true),
        ShardFailure::Archive(error) => {
            fail(batch.summary, batch.reporter, &error);
            Ok(is_disk_full(&error))
        }
    }
}

/// Keeps an archive that is up to date, and else renders its scenes.
fn complete_shard<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    file: &Path,
    list: &[NumberedScene],
) -> Result<(), ShardFailure> {
    let mut retried = Retried::default();
    if batch.plan.outputs.resume && file.is_file() {
        let past: Vec<_> = list.iter().map(|scene| batch.past_outcome(scene)).collect();
        let is_known = past.iter().all(Option::is_some);
        let absent = if is_known { Some(BTreeSet::new()) } else { absent_scenes(batch, file, list, &past) };
        if let Some(absent) = absent {
            let again = list.iter().filter(|scene| absent.contains(&scene.number));
            retried = retry(batch, scenes, file, again)?;
            if retried.images.is_empty() {
                batch.reporter.kept_archive(file);
                for (scene, outcome) in
                    list.iter().zip(past).filter(|(scene, _)| !absent.contains(&scene.number))
                {
                    batch.skip(scene, outcome.unwrap_or(PastOutcome::Done { images: 0 }));
                }
                if let Some(ledger) = &mut batch.ledger {
                    ledger.append().map_err(|error| error.context("--ledger"))?;
                }
                return Ok(());
            }
        }
    }
    let Retried { numbers, images } = retried;
    let mut rest = list.iter().filter(|scene| !numbers.contains(&scene.number)).cloned().map(Ok);
    fill_shard(batch, scenes, file, None, images, &mut rest).map(drop)
}

/// Scenes that were rendered before the others of their archive.
#[derive(Default)]
struct Retried {
    numbers: BTreeSet<usize>,
    /// The images of those that did not fail.
    images: EarlierImages,
}

/// Renders scenes of an archive that may fail again.
fn retry<'a: 'scope, 'scope, 'l>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    file: &Path,
    mut list: impl Iterator<Item = &'l NumberedScene>,
) -> Result<Retried, ShardFailure> {
    let mut retried = Retried::default();
    loop {
        while !is_queue_full(scenes)
            && let Some(scene) = list.next()
        {
            batch.start(scenes, scene.clone(), Some(file));
        }
        let Some(finished) = scenes.next_finished() else { return Ok(retried) };
        let number = finished.job.scene.number;
        retried.numbers.insert(number);
        match batch.finish_scene(finished) {
            Ok(Some(images)) => drop(retried.images.insert(number, images)),
            Err(error) if is_disk_full(&error) => return Err(ShardFailure::DiskFull),
            Ok(None) | Err(_) => {}
        }
    }
}

/// The numbers of scenes without images in an archive whose other images are complete and made from the same files with the
/// same settings; `None` for other archives. An archive is written as a whole, so absent scenes failed. Scenes that are
/// known to fail are not counted.
fn absent_scenes(
    batch: &Batch,
    file: &Path,
    scenes: &[NumberedScene],
    past: &[Option<PastOutcome>],
) -> Option<BTreeSet<usize>> {
    let expected = scenes.iter().zip(past).filter(|(_, past)| **past != Some(PastOutcome::Failed));
    let mut missing: BTreeMap<usize, &NumberedScene> =
        expected.map(|(scene, _)| (scene.number, scene)).collect();
    for archived in archived_scenes(file)? {
        let scene = missing.remove(&archived.number)?;
        if !archived.is_current(batch.plan, scene) {
            return None;
        }
    }
    Some(missing.into_keys().collect())
}
