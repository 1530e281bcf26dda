//! Archives of scenes. Each holds whole scenes in their order.

use std::ops::ControlFlow;

use super::batch::{Batch, Scenes};
use super::fill_shard::fill_shard;
use super::full_disk::is_disk_full;
use super::ledger::PastOutcome;
use super::shard_failure::give_up_shard;
use super::shard_scenes::{SceneIter, ShardScenes};
use crate::console::print_stdout;
use crate::plan::{NumberedScene, ShardPlan};
use crate::usage::UsageError;

/// Renders scenes into archives of a number of images: which scenes share one is known before they are rendered.
pub fn render_shards<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    shards: &ShardPlan,
    list: impl Iterator<Item = Result<NumberedScene, UsageError>>,
) -> Result<(), UsageError> {
    let mut group: Vec<NumberedScene> = Vec::new();
    for scene in list {
        let scene = scene?;
        let is_next = group.first().is_some_and(|first| is_before(shards, first, &scene));
        if is_next && render_shard(batch, scenes, shards, std::mem::take(&mut group))?.is_break() {
            return Ok(());
        }
        group.push(scene);
    }
    render_shard(batch, scenes, shards, group).map(drop)
}

/// Renders scenes into archives of a number of bytes. The scene that does not fit decides where an archive ends; a larger scene
/// has an archive of its own.
pub fn render_limited_shards<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    shards: &ShardPlan,
    list: SceneIter,
) -> Result<(), UsageError> {
    let mut list = ShardScenes::new(batch.plan, shards, list);
    let mut number = 0;
    while !list.is_empty() {
        if let Err(failure) = fill_shard(batch, scenes, shards, number, &mut list) {
            // Where the next archive begins is unknown.
            return give_up_shard(batch, scenes, failure).map(drop);
        }
        number += 1;
    }
    Ok(())
}

/// True if a scene is in an archive before that of another.
fn is_before(shards: &ShardPlan, scene: &NumberedScene, other: &NumberedScene) -> bool {
    shards.number(scene.number) < shards.number(other.number)
}

/// Renders the scenes of one archive, and reports its errors. Breaks if nothing more can be written.
fn render_shard<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    shards: &ShardPlan,
    group: Vec<NumberedScene>,
) -> Result<ControlFlow<()>, UsageError> {
    let Some(first) = group.first() else { return Ok(ControlFlow::Continue(())) };
    let number = shards.number(first.number);
    let file = shards.numbered(number);
    if batch.plan.dry_run {
        let printed = print_stdout(format!("{}\n", file.display()).as_bytes());
        let is_full = printed.is_err_and(|error| is_disk_full(&error));
        return Ok(if is_full { ControlFlow::Break(()) } else { ControlFlow::Continue(()) });
    }
    if batch.plan.outputs.resume && file.is_file() {
        let past: Option<Vec<PastOutcome>> = group.iter().map(|scene| batch.past_outcome(scene)).collect();
        // The ledger knows all of its scenes: it is not opened.
        if let Some(past) = past {
            batch.reporter.kept_archive(&file);
            group.iter().zip(past).for_each(|(scene, outcome)| batch.skip(scene, outcome));
            return Ok(ControlFlow::Continue(()));
        }
    }
    let mut list = ShardScenes::new(batch.plan, shards, Box::new(group.into_iter().map(Ok)));
    match fill_shard(batch, scenes, shards, number, &mut list) {
        Ok(()) => Ok(ControlFlow::Continue(())),
        Err(failure) => give_up_shard(batch, scenes, failure),
    }
}
