//! Renders the scenes of a plan, side by side.

use std::path::PathBuf;
use std::time::Duration;

use super::batch::{Batch, Scenes, fail, is_queue_full};
use super::full_disk::is_disk_full;
use super::golden_check::GoldenNames;
use super::progress::Reporter;
use super::report::Report;
use super::scene_ledger::SceneLedger;
use super::shard_batch::{render_limited_shards, render_shards};
use crate::args::ProcessArgs;
use crate::plan::{NumberedScene, RenderPlan};
use crate::plural::plural;
use crate::summary::Summary;
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_session::memory::peak_bytes;
use blinn_session::{format_bytes, run_scheduled};

/// Renders each scene of the plan's share, and returns the files that the last one was made from. The failure of a scene
/// does not affect the others.
pub fn render_scenes(
    plan: &RenderPlan,
    process: &ProcessArgs,
    reporter: &Reporter,
    summary: &mut Summary,
) -> Result<Vec<PathBuf>, UsageError> {
    let report = process.report.as_deref().filter(|_| !plan.dry_run);
    let report = match report.map(|file| Report::new(file, plan.outputs.replace)).transpose() {
        Ok(report) => report,
        Err(error) => {
            fail(summary, reporter, &error.context(worded!("`report`")));
            return Ok(Vec::new());
        }
    };
    let ledger = match SceneLedger::open(plan, process) {
        Ok(ledger) => ledger,
        Err(error) => {
            fail(summary, reporter, &error.context(worded!("`ledger`")));
            return Ok(Vec::new());
        }
    };
    let timeout =
        process.timeout.map(|seconds| Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
    let mut batch = Batch {
        plan,
        reporter,
        report,
        ledger,
        timeout,
        summary,
        in_archive: 0,
        scene_files: Vec::new(),
        goldens: GoldenNames::default(),
    };
    // File names are printed in order.
    let mut capacity = plan.session.capacity();
    if plan.dry_run {
        capacity.threads = 1;
    }
    let range = plan.scene_range();
    let range_length = range.len();
    if let Some(chunk) = plan.chunk.scenes.filter(|_| range.is_empty()) {
        let scenes = plural(plan.scenes.len() as u64, "scene");
        reporter.hint_of_run(&format!("nothing to render: share {chunk} of {scenes} is empty"));
    }
    let list = plan.numbered_scenes().skip(range.start).take(range_length);
    run_scheduled(capacity, |scenes| match &plan.outputs.shards {
        Some(shards) => match shards.max_bytes() {
            Some(_) => render_limited_shards(&mut batch, scenes, shards, Box::new(list)),
            None => render_shards(&mut batch, scenes, shards, list),
        },
        None => render_files(&mut batch, scenes, list),
    })?;
    if let Some(peak) = peak_bytes() {
        reporter.perf(&format!("memory   {:>10}  peak", format_bytes(peak)));
    }
    if !plan.dry_run {
        batch.summary.count_not_started(range_length);
    }
    let files = std::mem::take(&mut batch.scene_files);
    batch.finish();
    Ok(files)
}

/// Renders scenes whose images are files of their own.
fn render_files<'a: 'scope, 'scope>(
    batch: &mut Batch<'a>,
    scenes: &mut Scenes<'_, 'scope, 'a>,
    list: impl Iterator<Item = Result<NumberedScene, UsageError>>,
) -> Result<(), UsageError> {
    let mut list = list.peekable();
    loop {
        while !is_queue_full(scenes)
            && let Some(Ok(scene)) = list.next_if(Result::is_ok)
        {
            match batch.past_outcome(&scene) {
                Some(outcome) => batch.skip(&scene, outcome),
                None => batch.start(scenes, scene, None),
            }
        }
        let Some(finished) = scenes.next_finished() else { break };
        if batch.finish_scene(finished).is_err_and(|error| is_disk_full(&error)) {
            // Nothing more can be written, and one error for it is enough. Later scenes may be finished by now.
            scenes.stop();
            while let Some(late) = scenes.next_finished() {
                if !late.output.is_given_up() {
                    // A failure was reported.
                    let _ = batch.finish_scene(late);
                }
            }
            return Ok(());
        }
    }
    // The list cannot be read to its end.
    list.next().transpose().map(drop)
}
