//! Renders the scenes of a plan, one after the other.

use std::path::PathBuf;
use std::time::Duration;

use super::batch::{Batch, fail, is_disk_full};
use super::limited_shards::render_limited_shards;
use super::progress::Reporter;
use super::report::Report;
use super::scene_ledger::SceneLedger;
use super::shard_batch::render_shards;
use crate::args::ProcessArgs;
use crate::plan::RenderPlan;
use crate::summary::Summary;
use crate::usage::UsageError;
use blinn_session::format_bytes;
use blinn_session::memory::peak_bytes;

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
            fail(summary, reporter, &error.context("--report"));
            return Ok(Vec::new());
        }
    };
    let ledger = match SceneLedger::open(plan, process) {
        Ok(ledger) => ledger,
        Err(error) => {
            fail(summary, reporter, &error.context("--ledger"));
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
        shard: None,
        summary,
        scene_files: Vec::new(),
        imported: None,
    };
    let range = plan.scene_range();
    let scenes = plan.numbered_scenes().skip(range.start).take(range.len());
    match &plan.outputs.shards {
        Some(shards) => match shards.max_bytes() {
            Some(max_bytes) => render_limited_shards(&mut batch, shards, max_bytes, Box::new(scenes))?,
            None => render_shards(&mut batch, shards, scenes)?,
        },
        None => {
            let mut scenes = scenes.peekable();
            while let Some(scene) = scenes.next().transpose()? {
                let next = scenes.peek().and_then(|next| next.as_ref().ok());
                let outcome = batch.render_scene(&scene, next);
                if outcome.as_ref().is_err_and(is_disk_full) {
                    // Nothing more can be written, and one error for it is enough.
                    batch.summary.not_started = range.end - scene.number;
                    break;
                }
            }
        }
    }
    if let Some(peak) = peak_bytes() {
        reporter.perf(&format!("memory   {:>10}  peak", format_bytes(peak)));
    }
    let files = std::mem::take(&mut batch.scene_files);
    batch.finish();
    Ok(files)
}
