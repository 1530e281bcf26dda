//! `blinn render` and `blinn turntable`: renders each scene of a plan.

use std::ffi::OsString;
use std::time::Duration;

use super::batch::{Batch, fail, is_disk_full};
use super::memory_estimate::format_bytes;
use super::progress::Reporter;
use super::report::Report;
use super::runtime;
use super::scene_ledger::SceneLedger;
use super::shard_batch::render_shards;
use crate::bench::memory::peak_bytes;
use crate::cli::args::{ProcessArgs, RenderArgs, TurntableArgs};
use crate::cli::plan::{NumberedScene, RenderPlan};
use crate::cli::summary::Summary;
use crate::cli::usage::UsageError;

pub fn render(args: &RenderArgs, restart_argv: Option<&[OsString]>) -> Result<Summary, UsageError> {
    execute(&RenderPlan::for_render(args)?, restart_argv, &args.process, args.common.quiet)
}

pub fn turntable(args: &TurntableArgs, restart_argv: Option<&[OsString]>) -> Result<Summary, UsageError> {
    execute(&RenderPlan::for_turntable(args)?, restart_argv, &args.process, args.common.quiet)
}

/// Executes a plan. `restart_argv` are the arguments of this process, if it may execute itself again.
fn execute(
    plan: &RenderPlan,
    restart_argv: Option<&[OsString]>,
    process: &ProcessArgs,
    quiet: bool,
) -> Result<Summary, UsageError> {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    if let Some(argv) = restart_argv.filter(|_| !plan.dry_run) {
        super::malloc_tuning::restart_with_tunables(plan, argv);
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    let _ = restart_argv;
    let reporter = Reporter::new(&process.log, plan.scene_range().len(), quiet);
    let mut summary = Summary::default();
    // Only now: a restarted process would not know of a signal that arrived earlier.
    if let Err(error) = runtime::start(process.threads) {
        fail(&mut summary, &reporter, &error);
    } else {
        plan.check_clip_conflicts()?;
        render_scenes(plan, process, &reporter, &mut summary)?;
    }
    reporter.done(&summary);
    Ok(summary)
}

/// Renders each scene of the plan's share. The failure of a scene does not affect the others.
fn render_scenes(
    plan: &RenderPlan,
    process: &ProcessArgs,
    reporter: &Reporter,
    summary: &mut Summary,
) -> Result<(), UsageError> {
    let report = process.report.as_deref().filter(|_| !plan.dry_run);
    let report = match report.map(|file| Report::new(file, plan.outputs.replace)).transpose() {
        Ok(report) => report,
        Err(error) => {
            fail(summary, reporter, &error.context("--report"));
            return Ok(());
        }
    };
    let ledger = match SceneLedger::open(plan, process) {
        Ok(ledger) => ledger,
        Err(error) => {
            fail(summary, reporter, &error.context("--ledger"));
            return Ok(());
        }
    };
    let timeout =
        process.timeout.map(|seconds| Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
    let mut batch = Batch { plan, reporter, report, ledger, timeout, shard: None, summary };
    let range = plan.scene_range();
    let scenes = plan.numbered_scenes().skip(range.start).take(range.len());
    match &plan.outputs.shards {
        Some(shards) => render_shards(&mut batch, shards, scenes)?,
        None => {
            for scene in scenes {
                let NumberedScene { number, path } = scene?;
                let outcome = batch.render_scene(number, &path);
                if outcome.as_ref().is_err_and(is_disk_full) {
                    // Nothing more can be written, and one error for it is enough.
                    batch.summary.not_started = range.end - number;
                    break;
                }
            }
        }
    }
    if let Some(peak) = peak_bytes() {
        reporter.perf(&format!("memory   {:>10}  peak", format_bytes(peak)));
    }
    batch.finish();
    Ok(())
}
