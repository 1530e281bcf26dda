//! `blinn render` and `blinn turntable`: renders each scene of a plan.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;

use anyhow::{Error, Result};

use super::memory_estimate::format_bytes;
use super::progress::{Reporter, SceneLog};
use super::report::Report;
use super::scene_job::SceneJob;
use super::{panics, runtime};
use crate::batch::FileDigests;
use crate::bench::memory::peak_bytes;
use crate::cli::args::{ProcessArgs, RenderArgs, TurntableArgs};
use crate::cli::console::{scene_error, single_line};
use crate::cli::plan::{RenderPlan, load_limits};
use crate::cli::summary::Summary;
use crate::cli::usage::UsageError;
use crate::output::SaveError;

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
    let reporter = Reporter::new(&process.log, plan.scenes.len(), quiet);
    let mut summary = Summary::default();
    // Only now: a restarted process would not know of a signal that arrived earlier.
    if let Err(error) = runtime::start(process.threads) {
        fail(&mut summary, &reporter, &error);
    } else {
        plan.check_clip_conflicts()?;
        render_scenes(plan, process, &reporter, &mut summary);
    }
    reporter.done(&summary);
    Ok(summary)
}

/// Renders each scene. The failure of a scene does not affect the others.
fn render_scenes(plan: &RenderPlan, process: &ProcessArgs, reporter: &Reporter, summary: &mut Summary) {
    let report = process.report.as_deref().filter(|_| !plan.dry_run);
    let mut report = match report.map(|file| Report::new(file, plan.outputs.replace)).transpose() {
        Ok(report) => report,
        Err(error) => return fail(summary, reporter, &error.context("--report")),
    };
    for (i, path) in plan.scenes.iter().enumerate() {
        let outcome = render_scene(plan, i + 1, path, reporter, &mut report, summary);
        if outcome.as_ref().is_err_and(is_disk_full) {
            // Nothing more can be written, and one error for it is enough.
            summary.not_started = plan.scenes.len() - (i + 1);
            break;
        }
    }
    if let Some(peak) = peak_bytes() {
        reporter.perf(&format!("memory   {:>10}  peak", format_bytes(peak)));
    }
    match report.map(Report::finish) {
        None | Some(Ok(None)) => {}
        Some(Ok(Some(page))) => reporter.wrote(None, &page),
        Some(Err(error)) => fail(summary, reporter, &error),
    }
}

/// Renders a scene and reports its outcome.
fn render_scene(
    plan: &RenderPlan,
    index: usize,
    path: &Path,
    reporter: &Reporter,
    report: &mut Option<Report>,
    summary: &mut Summary,
) -> Result<()> {
    let mut log = SceneLog::new(reporter, path, plan.strict);
    if let Some(report) = report {
        report.begin_scene(path);
        log = log.collecting();
    }
    let digests = FileDigests::with_limit(load_limits(plan.max_memory).file_bytes);
    let report_page = report.as_mut();
    let views_shown = BTreeMap::new();
    let mut job = SceneJob {
        plan,
        index,
        path,
        log: &log,
        report: report_page,
        digests,
        frames: Vec::new(),
        kept: 0,
        views_shown,
    };
    let outcome = panics::catch(|| job.run());
    let kept = job.kept;
    reporter.scene_done(path);
    let failure = outcome.as_ref().err().map(|error| single_line(&scene_error(path, error)));
    let warnings = log.finish();
    if let Some(line) = &failure {
        reporter.fail(Some(path), line);
    }
    if let Some(page) = report
        && let Err(error) = page.end_scene(&warnings, kept, failure.as_deref())
    {
        // Images are rendered without the page.
        fail(summary, reporter, &Error::new(error).context("--report"));
        *report = None;
    }
    summary.add_scene(failure);
    outcome
}

/// Reports an error that belongs to no scene.
fn fail(summary: &mut Summary, reporter: &Reporter, error: &Error) {
    reporter.fail(None, &single_line(&format!("{error:#}")));
    summary.other_failure = true;
}

fn is_disk_full(error: &Error) -> bool {
    use std::io::{Error, ErrorKind};
    let is_full = |e: &Error| matches!(e.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded);
    error.chain().any(|cause| {
        let saved = cause.downcast_ref::<SaveError>().map(|e| &e.cause);
        saved.or(cause.downcast_ref()).is_some_and(is_full)
    })
}
