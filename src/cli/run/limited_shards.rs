//! Archives of limited bytes. Each holds as many whole scenes as fit, in their order; a larger scene has an archive of its own.
//!
//! The scene that does not fit decides where an archive ends, so `--resume` keeps an archive only if the next one proves its
//! end.

use std::collections::VecDeque;

use super::archived_scenes::archived_scenes;
use super::batch::{Batch, Scenes, fail};
use super::fill_shard::{EarlierImages, Overflow, ShardFailure, fill_shard};
use super::ledger::PastOutcome;
use crate::plan::{NumberedScene, ShardPlan};
use crate::usage::UsageError;

/// Scenes one after the other.
type SceneIter<'s> = Box<dyn Iterator<Item = Result<NumberedScene, UsageError>> + 's>;

/// Renders scenes into archives of at most `max_bytes`. With --resume, archives that are up to date are kept.
pub fn render_limited_shards<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    shards: &ShardPlan,
    max_bytes: u64,
    list: SceneIter,
) -> Result<(), UsageError> {
    let mut queue = SceneQueue { ahead: VecDeque::new(), rest: list };
    // The first scene of the next archive, if it was rendered because it did not fit.
    let mut carried: Overflow = None;
    for number in 0usize.. {
        let file = shards.numbered(number);
        if batch.plan.outputs.resume && file.is_file() {
            // Scenes that are in the archive need not be rendered.
            for task in scenes.cancel().iter().rev() {
                queue.ahead.push_front(task.scene.clone());
            }
            if let Some((scene, _)) = &carried {
                queue.ahead.push_front(scene.clone());
            }
            if keep_shard(batch, shards, number, max_bytes, &mut queue)? {
                carried = None;
                continue;
            }
            if carried.is_some() {
                queue.ahead.pop_front();
            }
        }
        if carried.is_none() && scenes.is_empty() && queue.is_empty()? {
            break;
        }
        let earlier = EarlierImages::from_iter(carried.take().map(|(scene, images)| (scene.number, images)));
        match fill_shard(batch, scenes, &file, Some(max_bytes), earlier, &mut queue) {
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
                batch.summary.not_started = started + queue.remaining()?;
                break;
            }
        }
    }
    Ok(())
}

/// The scenes that are not in an archive yet.
struct SceneQueue<'s> {
    /// Those that were looked at.
    ahead: VecDeque<NumberedScene>,
    rest: SceneIter<'s>,
}

impl SceneQueue<'_> {
    fn is_empty(&mut self) -> Result<bool, UsageError> {
        if self.ahead.is_empty() {
            self.ahead.extend(self.rest.next().transpose()?);
        }
        Ok(self.ahead.is_empty())
    }

    /// Looks at scenes up to the one with a number, and at the one behind it.
    fn look_behind(&mut self, number: usize) -> Result<(), UsageError> {
        while self.ahead.back().is_none_or(|last| last.number <= number) {
            let Some(scene) = self.rest.next().transpose()? else { break };
            self.ahead.push_back(scene);
        }
        Ok(())
    }

    /// The number of scenes.
    fn remaining(self) -> Result<usize, UsageError> {
        let mut count = self.ahead.len();
        for scene in self.rest {
            scene?;
            count += 1;
        }
        Ok(count)
    }
}

impl Iterator for SceneQueue<'_> {
    type Item = Result<NumberedScene, UsageError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.ahead.pop_front().map(Ok).or_else(|| self.rest.next())
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
    for scene in queue.ahead.iter().take_while(|scene| scene.number <= last) {
        match archived.next_if(|archived| archived.is_current(batch.plan, scene)) {
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
        if let Some(scene) = queue.ahead.pop_front() {
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
        let Some(scene) = queue.ahead.iter().find(|scene| scene.number > behind) else { return Ok(true) };
        if has_failed(batch, scene) {
            behind = scene.number;
            continue;
        }
        let next = archived_scenes(&shards.numbered(number + 1));
        let first = next.as_ref().and_then(|scenes| scenes.first());
        return Ok(first.is_some_and(|first| {
            bytes.saturating_add(first.bytes) > max_bytes && first.is_current(batch.plan, scene)
        }));
    }
}

/// Returns true if the ledger says that a scene fails and is not to be tried again.
fn has_failed(batch: &Batch, scene: &NumberedScene) -> bool {
    batch.past_outcome(scene) == Some(PastOutcome::Failed)
}
