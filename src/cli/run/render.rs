//! `blinn render` and `blinn turntable`: pictures of each scene.

use std::ffi::OsString;

use crate::batch::FileDigests;
use crate::bench::memory::peak_bytes;
use crate::cli::args::{ProcessArgs, RenderArgs, TurntableArgs};
use crate::cli::plan::Job;
use crate::cli::plan::memory;
use crate::cli::run::panics;
use crate::cli::run::progress::{Reporter, Teller};
use crate::cli::run::report::Report;
use crate::cli::run::scene_job::Work;
use crate::cli::{Summary, Usage, describe, one_line};
use crate::output::SaveError;

pub(crate) fn render(args: &RenderArgs, words: &[OsString]) -> Result<Summary, Usage> {
    carry_out(&Job::render(args)?, words, &args.process, args.common.quiet)
}

/// The same with the scene turned a little from frame to frame.
pub(crate) fn turntable(args: &TurntableArgs, words: &[OsString]) -> Result<Summary, Usage> {
    carry_out(&Job::turntable(args)?, words, &args.process, args.common.quiet)
}

/// Makes all pictures of a job that `words` ask for.
fn carry_out(job: &Job, words: &[OsString], process: &ProcessArgs, quiet: bool) -> Result<Summary, Usage> {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    if !job.dry_run {
        crate::cli::run::malloc_tuning::begin_again(job, words);
    }
    let reporter = Reporter::new(&process.telling, job.scenes.len(), quiet);
    let summary = each(job, process, &reporter)?;
    reporter.done(&summary);
    Ok(summary)
}

/// Makes the pictures of each scene. What goes wrong with one does not keep the others from theirs.
fn each(job: &Job, process: &ProcessArgs, reporter: &Reporter) -> Result<Summary, Usage> {
    let mut summary = Summary::default();
    // Only now: a process that begins again knows nothing of a signal that it was sent before.
    if let Err(e) = crate::cli::set_out(process.threads) {
        reporter.fail(None, &one_line(&e.to_string()));
        summary.otherwise = true;
        return Ok(summary);
    }
    job.check_clips()?;
    let report = process.report.as_deref().filter(|_| !job.dry_run);
    let mut report = match report.map(|file| Report::new(file, job.outputs.replace)).transpose() {
        Ok(report) => report,
        Err(e) => {
            reporter.fail(None, &one_line(&format!("--report: {e:#}")));
            summary.otherwise = true;
            return Ok(summary);
        }
    };
    for (i, path) in job.scenes.iter().enumerate() {
        let teller = Teller::new(reporter, path, job.strict);
        let (index, contents) = (i + 1, FileDigests::with_limit(memory::limits(job.max_memory).file_bytes));
        if let Some(report) = &mut report {
            report.scene(path);
        }
        let mut work = Work { job, index, path, teller: &teller, report: report.as_mut(), contents, kept: 0 };
        let outcome = panics::caught(|| work.run());
        let kept = work.kept;
        reporter.scene_done(path);
        let failure = outcome.as_ref().err().map(|e| one_line(&describe(path, e)));
        if let Some(line) = &failure {
            reporter.fail(Some(path), line);
        }
        if let Some(page) = &mut report
            && let Err(e) = page.scene_done(&teller.warnings(), kept, failure.as_deref())
        {
            // Pictures need no page.
            reporter.fail(None, &one_line(&format!("--report: {e}")));
            summary.otherwise = true;
            report = None;
        }
        summary.add(failure);
        if outcome.as_ref().is_err_and(disk_is_full) {
            // Nothing more can be written: one line for it is enough.
            summary.left = job.scenes.len() - index;
            break;
        }
    }
    if let Some(peak) = peak_bytes() {
        reporter.perf(&format!("memory   {:>10}  at most", memory::text(peak)));
    }
    match report.map(Report::finish) {
        None | Some(Ok(None)) => {}
        Some(Ok(Some(page))) => reporter.wrote(None, &page),
        Some(Err(e)) => {
            reporter.fail(None, &one_line(&format!("{e:#}")));
            summary.otherwise = true;
        }
    }
    Ok(summary)
}

fn disk_is_full(error: &anyhow::Error) -> bool {
    use std::io::{Error, ErrorKind};
    let full = |e: &Error| matches!(e.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded);
    error.chain().any(|cause| {
        let saved = cause.downcast_ref::<SaveError>().map(|e| &e.cause);
        saved.or(cause.downcast_ref()).is_some_and(full)
    })
}
