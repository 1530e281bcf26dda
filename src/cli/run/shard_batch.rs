//! The scenes of a run whose images go into archives: archive by archive.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;

use anyhow::{Context, Error, Result};
use serde_json::Value;

use super::batch::{Batch, Scenes, fail, is_disk_full, is_full};
use super::ledger::PastOutcome;
use crate::console::print_stdout;
use crate::files::create_parent_folder;
use crate::plan::{NumberedScene, ShardPlan, sample_key};
use crate::usage::UsageError;
use blinn_output::{ShardMember, ShardWriter, check_overwrite, read_shard};
use blinn_session::{FileDigests, PlannedFrame, load_limits};

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
            let file = shards.file(group[0].number);
            let is_full = render_shard(batch, scenes, &file, &group).is_err_and(|e| is_disk_full(&e));
            group.clear();
            if is_full {
                batch.summary.not_started = batch.plan.scene_range().end + 1 - scene.number;
                return Ok(());
            }
        }
        group.push(scene);
    }
    if let Some(first) = group.first() {
        // The error was reported.
        let _ = render_shard(batch, scenes, &shards.file(first.number), &group);
    }
    Ok(())
}

/// Renders the scenes of one archive. The errors were reported.
fn render_shard<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    file: &Path,
    list: &[NumberedScene],
) -> Result<()> {
    if batch.plan.dry_run {
        return print_stdout(format!("{}\n", file.display()).as_bytes());
    }
    let outcome = complete_shard(batch, scenes, file, list);
    if outcome.is_err() {
        drop(scenes.cancel());
        if let Some(ledger) = &mut batch.ledger {
            ledger.discard();
        }
    }
    outcome.map_err(|failure| match failure {
        ShardFailure::OfScene(error) => error,
        ShardFailure::OfArchive(error) => {
            fail(batch.summary, batch.reporter, &error);
            error
        }
    })
}

/// The reason why an archive was not written.
enum ShardFailure {
    /// The disk is full. The error was reported with its scene.
    OfScene(Error),
    OfArchive(Error),
}

impl From<Error> for ShardFailure {
    fn from(error: Error) -> ShardFailure {
        ShardFailure::OfArchive(error)
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
                return append_to_ledger(batch);
            }
        }
    }
    fill_shard(batch, scenes, file, list, retried)
}

/// Scenes that were rendered before the others of their archive.
#[derive(Default)]
struct Retried {
    numbers: BTreeSet<usize>,
    /// The images of those that did not fail.
    images: BTreeMap<usize, ShardWriter>,
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
        while !is_full(scenes)
            && let Some(scene) = list.next()
        {
            batch.start(scenes, scene.clone(), Some(file));
        }
        let Some(finished) = scenes.next_finished() else { return Ok(retried) };
        let number = finished.job.scene.number;
        retried.numbers.insert(number);
        match batch.finish_scene(finished) {
            Ok(Some(images)) => drop(retried.images.insert(number, images)),
            Err(error) if is_disk_full(&error) => return Err(ShardFailure::OfScene(error)),
            Ok(None) | Err(_) => {}
        }
    }
}

fn append_to_ledger(batch: &mut Batch) -> Result<(), ShardFailure> {
    if let Some(ledger) = &mut batch.ledger {
        ledger.append().context("--ledger")?;
    }
    Ok(())
}

/// Renders scenes into an archive, and notes them in the ledger when it is complete. Takes the images of `retried` scenes as
/// they are.
fn fill_shard<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    file: &Path,
    list: &[NumberedScene],
    mut retried: Retried,
) -> Result<(), ShardFailure> {
    let cannot_be_written = || format!("{} cannot be written", file.display());
    check_overwrite(file, batch.plan.outputs.replace).map_err(Error::new)?;
    create_parent_folder(file)?;
    let mut shard = ShardWriter::new(file).with_context(cannot_be_written)?;
    let mut list = list.iter().filter(|scene| !retried.numbers.contains(&scene.number));
    loop {
        while !is_full(scenes)
            && let Some(scene) = list.next()
        {
            batch.start(scenes, scene.clone(), Some(file));
        }
        let Some(finished) = scenes.next_finished() else { break };
        let later = retried.images.split_off(&finished.job.scene.number);
        for images in std::mem::replace(&mut retried.images, later).into_values() {
            shard.append(images).with_context(cannot_be_written)?;
        }
        match batch.finish_scene(finished) {
            Ok(Some(members)) => shard.append(members).with_context(cannot_be_written)?,
            Err(error) if is_disk_full(&error) => return Err(ShardFailure::OfScene(error)),
            // A scene that fails has no images.
            Ok(None) | Err(_) => {}
        }
    }
    for images in retried.images.into_values() {
        shard.append(images).with_context(cannot_be_written)?;
    }
    if shard.length() > 0 {
        shard.finish(batch.plan.outputs.replace).with_context(cannot_be_written)?;
        batch.reporter.wrote(None, file);
    }
    append_to_ledger(batch)
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
    let plan = batch.plan;
    let frames = plan.frames.known().unwrap_or_default();
    let mut missing: HashMap<String, (usize, &PlannedFrame)> = HashMap::new();
    for (i, NumberedScene { number, path }) in scenes.iter().enumerate() {
        if past[i] != Some(PastOutcome::Failed) {
            let key = |frame: &PlannedFrame| sample_key(path, *number, frame.number);
            missing.extend(frames.iter().map(|frame| (key(frame), (i, frame))));
        }
    }
    let max_bytes = load_limits(plan.session.max_memory).file_bytes;
    let mut digests: Vec<FileDigests> = scenes.iter().map(|_| FileDigests::with_limit(max_bytes)).collect();
    let stale = || std::io::Error::other("not up to date");
    let check = |ShardMember { name, bytes, .. }: ShardMember| {
        if !is_description(name) {
            return Ok(());
        }
        let (key, _) = name.split_once('.').unwrap_or_default();
        let (i, frame) = missing.remove(key).ok_or_else(stale)?;
        let sample: Value = serde_json::from_slice(bytes)?;
        let fingerprint = sample["fingerprint"].as_str().ok_or_else(stale)?;
        let hash = plan.member_hash(frame).ok_or_else(stale)?;
        let is_current = digests[i].is_current(fingerprint, hash, &scenes[i].path);
        if is_current { Ok(()) } else { Err(stale()) }
    };
    read_shard(file, is_description, check).ok()?;
    let mut absent: HashMap<usize, usize> = HashMap::new();
    missing.values().for_each(|(i, _)| *absent.entry(*i).or_default() += 1);
    let is_whole = absent.values().all(|count| *count == frames.len());
    is_whole.then(|| absent.keys().map(|i| scenes[*i].number).collect())
}

/// Returns true for the description of a sample.
pub fn is_description(name: &str) -> bool {
    name.split_once('.').is_some_and(|(_, extension)| extension == "json")
}
