//! Fills an archive with the images of scenes, until no scene is left or one does not fit.

use anyhow::Context;

use super::batch::{Batch, Scenes};
use super::full_disk::is_disk_full;
use super::ledger::PastOutcome;
use super::new_shard::{NewShard, ShardEnd};
use super::shard_failure::ShardFailure;
use super::shard_scenes::{SceneTurn, ShardScenes};
use crate::plan::ShardPlan;

/// Fills the archive of a number with the next scenes, and notes them in the ledger when it is complete. Ends before the first
/// scene with which it would have more than `max_bytes`; a scene that is larger has an archive of its own.
///
/// Images of an earlier run are copied if they are up to date. They also stay where their scene fails now, if their settings
/// are the same: nothing complete is replaced by less.
pub fn fill_shard<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    shards: &ShardPlan,
    number: usize,
    list: &mut ShardScenes<'_, 'a>,
) -> Result<(), ShardFailure> {
    let file = shards.numbered(number);
    let cannot_be_written = || format!("{} cannot be written", file.display());
    let mut shard = NewShard::new(&file, list.earlier.open(number)?);
    while let Some(turn) = list.next_turn(batch, scenes, &file)? {
        let length = shard.length().saturating_add(turn.bytes());
        if shard.length() > 0 && shards.max_bytes().is_some_and(|max| length > max) {
            list.carry(turn);
            break;
        }
        let SceneTurn { scene, past, archived, rendered } = turn;
        let outcome = match (rendered, &archived) {
            (Some(finished), _) => batch.finish_scene(finished),
            (None, Some(images)) if images.is_current => {
                batch.keep(&scene, images.count, past);
                Ok(None)
            }
            (None, _) => {
                batch.skip(&scene, PastOutcome::Failed);
                Ok(None)
            }
        };
        match (outcome, archived) {
            (Ok(Some(part)), _) => shard.add(part).with_context(cannot_be_written)?,
            (Err(error), _) if is_disk_full(&error) => return Err(ShardFailure::DiskFull),
            (_, Some(images)) => shard.keep(&images).with_context(cannot_be_written)?,
            // A scene that fails has no images.
            (_, None) => {}
        }
    }
    let end = shard.finish(batch.plan.outputs.replace).with_context(cannot_be_written)?;
    match end {
        ShardEnd::Wrote => batch.reporter.wrote(None, &file),
        ShardEnd::Kept => batch.reporter.kept_archive(&file),
        ShardEnd::Empty => {}
    }
    batch.complete_archive(matches!(end, ShardEnd::Wrote));
    Ok(())
}
