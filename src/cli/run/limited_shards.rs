//! Archives of limited bytes. Each holds as many whole scenes as fit, in their order; a larger scene has an archive of its own.
//!
//! The scene that does not fit decides where an archive ends, so `--resume` keeps an archive only if the next one proves its
//! end.

use std::collections::VecDeque;
use std::path::Path;

use anyhow::{Context, Error, Result};
use serde_json::Value;

use super::batch::{Batch, Scenes, fail, is_disk_full, is_full};
use super::ledger::PastOutcome;
use super::shard_batch::is_description;
use crate::files::create_parent_folder;
use crate::plan::{NumberedScene, ShardPlan, sample_key};
use crate::usage::UsageError;
use blinn_output::{ShardWriter, check_overwrite, read_shard};
use blinn_session::{FileDigests, load_limits};

/// Scenes one after the other.
type SceneIter<'s> = Box<dyn Iterator<Item = Result<NumberedScene, UsageError>> + 's>;

/// A scene that did not fit into an archive, and its images.
type Overflow = Option<(NumberedScene, ShardWriter)>;

/// Renders scenes into archives of at most `max_bytes`. With --resume, archives that are up to date are kept.
pub fn render_limited_shards<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    shards: &ShardPlan,
    max_bytes: u64,
    list: SceneIter,
) -> Result<(), UsageError> {
    let mut queue = SceneQueue { next: VecDeque::new(), rest: list };
    // The first scene of the next archive, if it was rendered because it did not fit.
    let mut carried: Overflow = None;
    for number in 0usize.. {
        let file = shards.numbered(number);
        if batch.plan.outputs.resume && file.is_file() {
            // Scenes that are in the archive need not be rendered.
            for task in scenes.cancel().iter().rev() {
                queue.next.push_front(task.scene.clone());
            }
            if let Some((scene, _)) = &carried {
                queue.next.push_front(scene.clone());
            }
            if keep_shard(batch, shards, number, max_bytes, &mut queue)? {
                carried = None;
                continue;
            }
            if carried.is_some() {
                queue.next.pop_front();
            }
        }
        if carried.is_none() && scenes.is_empty() && queue.peek()?.is_none() {
            break;
        }
        match fill_shard(batch, scenes, &file, max_bytes, carried.take(), &mut queue) {
            Ok(overflow) => carried = overflow,
            Err(failure) => {
                let started = scenes.cancel().len();
                if let Some(ledger) = &mut batch.ledger {
                    ledger.discard();
                }
                match failure {
                    ShardFailure::Usage(error) => return Err(error),
                    ShardFailure::Archive(error) => fail(batch.summary, batch.reporter, &error),
                    ShardFailure::DiskFull => {}
                }
                // Where the next archive begins is unknown.
                batch.summary.not_started = started + queue.count()?;
                break;
            }
        }
    }
    Ok(())
}

/// The reason why an archive was not written.
enum ShardFailure {
    Usage(UsageError),
    Archive(Error),
    /// It was reported with its scene.
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

/// The scenes that are not in an archive yet.
struct SceneQueue<'s> {
    /// Those that were looked at.
    next: VecDeque<NumberedScene>,
    rest: SceneIter<'s>,
}

impl SceneQueue<'_> {
    fn peek(&mut self) -> Result<Option<&NumberedScene>, UsageError> {
        if self.next.is_empty() {
            self.next.extend(self.rest.next().transpose()?);
        }
        Ok(self.next.front())
    }

    fn pop(&mut self) -> Result<Option<NumberedScene>, UsageError> {
        self.peek()?;
        Ok(self.next.pop_front())
    }

    /// Looks at scenes up to the one with a number, and at the one behind it.
    fn look_behind(&mut self, number: usize) -> Result<(), UsageError> {
        while self.next.back().is_none_or(|last| last.number <= number) {
            let Some(scene) = self.rest.next().transpose()? else { break };
            self.next.push_back(scene);
        }
        Ok(())
    }

    /// The number of scenes.
    fn count(self) -> Result<usize, UsageError> {
        let mut count = self.next.len();
        for scene in self.rest {
            scene?;
            count += 1;
        }
        Ok(count)
    }
}

/// Renders scenes into an archive until one does not fit, and returns that one.
fn fill_shard<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    file: &Path,
    max_bytes: u64,
    carried: Overflow,
    queue: &mut SceneQueue,
) -> Result<Overflow, ShardFailure> {
    let cannot_be_written = || format!("{} cannot be written", file.display());
    check_overwrite(file, batch.plan.outputs.replace).map_err(Error::new)?;
    create_parent_folder(file)?;
    let mut shard = ShardWriter::new(file).with_context(cannot_be_written)?;
    if let Some((_, members)) = carried {
        shard.append(members).with_context(cannot_be_written)?;
    }
    let mut overflow = None;
    loop {
        while !is_full(scenes)
            && let Some(scene) = queue.pop()?
        {
            batch.start(scenes, scene, Some(file));
        }
        let Some(finished) = scenes.next_finished() else { break };
        let scene = finished.job.scene.clone();
        match batch.finish_scene(finished) {
            Ok(Some(members)) if shard.length() > 0 && shard.length() + members.length() > max_bytes => {
                overflow = Some((scene, members));
                break;
            }
            Ok(Some(members)) => shard.append(members).with_context(cannot_be_written)?,
            Err(error) if is_disk_full(&error) => return Err(ShardFailure::DiskFull),
            // A scene that fails has no images.
            Ok(None) | Err(_) => {}
        }
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

/// A scene in an archive.
struct ArchivedScene {
    number: usize,
    /// Bytes of its files with their headers.
    bytes: u64,
    /// The key and the fingerprint of each sample.
    samples: Vec<(String, String)>,
}

/// The scenes of an archive in order. `None` for anything but a complete archive.
fn archived_scenes(file: &Path) -> Option<Vec<ArchivedScene>> {
    let mut scenes: Vec<ArchivedScene> = Vec::new();
    let other = || std::io::Error::other("not an archive of samples");
    read_shard(file, is_description, |member| {
        let (key, _) = member.name.split_once('.').ok_or_else(other)?;
        let number: usize = key.split('-').next().and_then(|digits| digits.parse().ok()).ok_or_else(other)?;
        if scenes.last().is_none_or(|last| last.number != number) {
            scenes.push(ArchivedScene { number, bytes: 0, samples: Vec::new() });
        }
        let scene = scenes.last_mut().ok_or_else(other)?;
        scene.bytes += member.length;
        if is_description(member.name) {
            let sample: Value = serde_json::from_slice(member.bytes)?;
            let fingerprint = sample["fingerprint"].as_str().ok_or_else(other)?;
            scene.samples.push((key.to_string(), fingerprint.to_string()));
        }
        Ok(())
    })
    .ok()?;
    Some(scenes)
}

impl ArchivedScene {
    /// Returns true if the samples are those of a scene, made from the same files with the same settings.
    fn is_current(&self, batch: &Batch, scene: &NumberedScene) -> bool {
        let plan = batch.plan;
        let frames = plan.frames.known().unwrap_or_default();
        let mut digests = FileDigests::with_limit(load_limits(plan.session.max_memory).file_bytes);
        let mut is_same = |(frame, (key, fingerprint)): (_, &(String, String))| {
            let hash = plan.member_hash(frame);
            *key == sample_key(&scene.path, scene.number, frame.number)
                && hash.is_some_and(|hash| digests.is_current(fingerprint, hash, &scene.path))
        };
        self.number == scene.number
            && self.samples.len() == frames.len()
            && frames.iter().zip(&self.samples).all(&mut is_same)
    }
}

/// Returns true if an archive is up to date, and takes its scenes from the queue. It holds the next scenes, except those
/// that are known to fail, and the first of the next archive would not fit.
fn keep_shard(
    batch: &mut Batch,
    shards: &ShardPlan,
    number: usize,
    max_bytes: u64,
    queue: &mut SceneQueue,
) -> Result<bool, UsageError> {
    let Some(archived) = archived_scenes(&shards.numbered(number)).filter(|scenes| !scenes.is_empty()) else {
        return Ok(false);
    };
    let last = archived.iter().map(|scene| scene.number).max().unwrap_or(0);
    queue.look_behind(last)?;
    let bytes: u64 = archived.iter().map(|scene| scene.bytes).sum();
    if bytes > max_bytes && archived.len() > 1 {
        return Ok(false);
    }
    let mut archived = archived.iter().peekable();
    let mut outcomes = Vec::new();
    for scene in queue.next.iter().take_while(|scene| scene.number <= last) {
        match archived.next_if(|archived| archived.is_current(batch, scene)) {
            Some(_) => outcomes.push(PastOutcome::Done { images: 0 }),
            None if has_failed(batch, scene) => outcomes.push(PastOutcome::Failed),
            None => return Ok(false),
        }
    }
    if archived.next().is_some() || !proves_end(batch, shards, number, bytes, max_bytes, queue)? {
        return Ok(false);
    }
    batch.reporter.kept_archive(&shards.numbered(number));
    for outcome in outcomes {
        if let Some(scene) = queue.next.pop_front() {
            batch.skip(&scene, outcome);
        }
    }
    Ok(true)
}

/// Returns true if no scene follows an archive of `bytes`, or the next archive begins with one that does not fit.
fn proves_end(
    batch: &Batch,
    shards: &ShardPlan,
    number: usize,
    bytes: u64,
    max_bytes: u64,
    queue: &mut SceneQueue,
) -> Result<bool, UsageError> {
    let last = archived_scenes(&shards.numbered(number)).and_then(|scenes| scenes.last().map(|s| s.number));
    let mut behind = last.unwrap_or(0);
    loop {
        queue.look_behind(behind)?;
        let Some(scene) = queue.next.iter().find(|scene| scene.number > behind) else { return Ok(true) };
        if has_failed(batch, scene) {
            behind = scene.number;
            continue;
        }
        let next = archived_scenes(&shards.numbered(number + 1));
        let first = next.as_ref().and_then(|scenes| scenes.first());
        return Ok(first.is_some_and(|first| {
            bytes.saturating_add(first.bytes) > max_bytes && first.is_current(batch, scene)
        }));
    }
}

/// Returns true if the ledger says that a scene fails and is not to be tried again.
fn has_failed(batch: &Batch, scene: &NumberedScene) -> bool {
    batch.past_outcome(scene) == Some(PastOutcome::Failed)
}
