//! The scenes of a run: each is rendered, reported and noted in the ledger.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Error, Result, anyhow};

use super::imported_scene::{ImportedScene, NextScene};
use super::ledger::{ImageCounts, LedgerEntry, PastOutcome};
use super::panics;
use super::progress::{Reporter, SceneLog};
use super::report::Report;
use super::scene_job::SceneJob;
use super::scene_ledger::SceneLedger;
use crate::console::{scene_error, single_line};
use crate::plan::{NumberedScene, RenderPlan};
use crate::summary::Summary;
use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_import::LoadError;
use blinn_output::{SaveError, ShardWriter};
use blinn_scene::ClipBoundsCache;
use blinn_session::{FileDigests, SessionError, load_limits};

/// The scenes of a run, and what is written about them.
pub struct Batch<'a> {
    pub plan: &'a RenderPlan,
    pub reporter: &'a Reporter,
    pub report: Option<Report>,
    pub ledger: Option<SceneLedger<'a>>,
    /// Time that a scene may take.
    pub timeout: Option<Duration>,
    /// The archive that images go into.
    pub shard: Option<ShardWriter>,
    pub summary: &'a mut Summary,
    /// The files that the last scene was made from; empty if it was not read.
    pub scene_files: Vec<PathBuf>,
    /// The scene that was read while the last one was rendered.
    pub imported: Option<(usize, ImportedScene)>,
}

impl Batch<'_> {
    /// Renders a scene and reports its outcome, unless the ledger has it. Meanwhile reads the scene that follows.
    pub fn render_scene(&mut self, scene: &NumberedScene, next: Option<&NumberedScene>) -> Result<()> {
        let Batch { plan, reporter, timeout, .. } = *self;
        let NumberedScene { number: index, ref path } = *scene;
        let imported =
            self.imported.take().filter(|(number, _)| *number == index).map(|(_, imported)| imported);
        if let Some(outcome) = self.past_outcome(scene) {
            self.skip(path, outcome);
            return Ok(());
        }
        let next = next.filter(|next| self.past_outcome(next).is_none());
        let key = self.ledger.as_ref().map(|ledger| ledger.key(path, index)).unwrap_or_default();
        let since = Instant::now();
        let mut log = SceneLog::new(reporter, path, plan.strict);
        if let Some(report) = &mut self.report {
            report.begin_scene(path);
        }
        if self.report.is_some() || self.ledger.is_some() {
            log = log.collecting();
        }
        let load_time = imported.as_ref().map_or(Duration::ZERO, |imported| imported.time);
        let cancel = timeout.map_or_else(CancelToken::default, CancelToken::with_timeout);
        let mut job = SceneJob {
            plan,
            index,
            path,
            log: &log,
            report: self.report.as_mut(),
            shard: self.shard.as_mut(),
            digests: FileDigests::with_limit(load_limits(plan.session.max_memory).file_bytes),
            frames: Vec::new(),
            images: ImageCounts::default(),
            cancel: cancel.clone(),
            imported,
            next: next.map(|next| NextScene { path: &next.path, timeout }),
            imported_next: None,
            waited: Duration::ZERO,
            views_shown: BTreeMap::new(),
            clip_bounds: ClipBoundsCache::cancelled_by(&cancel),
            scene_files: Vec::new(),
        };
        let outcome = panics::catch(|| job.run());
        let outcome = match timeout {
            Some(timeout) if outcome.as_ref().is_err_and(is_cancellation) => Err(timeout_error(timeout)),
            _ => outcome,
        };
        let time = since.elapsed().saturating_sub(job.waited) + load_time;
        let images = job.images;
        self.imported = next.and_then(|next| Some((next.number, job.imported_next.take()?)));
        self.scene_files = std::mem::take(&mut job.scene_files);
        reporter.scene_done(path);
        let failure = outcome.as_ref().err().map(|error| single_line(&scene_error(path, error)));
        let warnings = log.finish();
        if let Some(line) = &failure {
            reporter.fail(Some(path), line);
        }
        if let Some(page) = &mut self.report
            && let Err(error) = page.end_scene(&warnings, images.kept as usize, failure.as_deref())
        {
            // Images are rendered without the page.
            fail(self.summary, reporter, &Error::new(error).context("--report"));
            self.report = None;
        }
        let failure_line = failure.as_deref();
        let entry =
            LedgerEntry { key, scene: path, index, failure: failure_line, warnings: &warnings, time, images };
        if let Some(ledger) = &mut self.ledger
            && let Err(error) = ledger.add(&entry)
        {
            // Images are rendered without the ledger.
            fail(self.summary, reporter, &error.context("--ledger"));
            self.ledger = None;
        }
        self.summary.add_scene(failure);
        outcome
    }

    /// The outcome for which the ledger skips a scene. `None` while an archive is written, which is made as a whole.
    pub fn past_outcome(&self, NumberedScene { number, path }: &NumberedScene) -> Option<PastOutcome> {
        let ledger = self.ledger.as_ref().filter(|_| self.shard.is_none())?;
        ledger.skips(ledger.key(path, *number), path, *number)
    }

    /// Counts a scene whose outcome is known.
    pub fn skip(&mut self, path: &Path, outcome: PastOutcome) {
        match outcome {
            PastOutcome::Done { .. } => self.summary.skipped_done += 1,
            PastOutcome::Failed => self.summary.skipped_failed += 1,
        }
        self.reporter.scene_done(path);
    }

    /// Writes the page and the totals.
    pub fn finish(self) {
        match self.report.map(Report::finish) {
            None | Some(Ok(None)) => {}
            Some(Ok(Some(page))) => self.reporter.wrote(None, &page),
            Some(Err(error)) => fail(self.summary, self.reporter, &error),
        }
        if let Some(ledger) = &self.ledger {
            self.reporter.totals(&ledger.totals(self.summary));
        }
    }
}

/// Reports an error that belongs to no scene.
pub fn fail(summary: &mut Summary, reporter: &Reporter, error: &Error) {
    reporter.fail(None, &single_line(&format!("{error:#}")));
    summary.other_failure = true;
}

/// Returns true for the error of work that was cancelled.
fn is_cancellation(error: &Error) -> bool {
    let is_load_error = |e: &LoadError| matches!(e, LoadError::Cancelled(_));
    error.chain().any(|cause| {
        cause.is::<Cancelled>()
            || cause.downcast_ref().is_some_and(is_load_error)
            || cause.downcast_ref().is_some_and(SessionError::is_cancelled)
    })
}

fn timeout_error(timeout: Duration) -> Error {
    anyhow!(
        "gave up after {} s; raise --timeout, or make the scene or its images smaller",
        timeout.as_secs_f64()
    )
}

/// Returns true for the error of a full disk.
pub fn is_disk_full(error: &Error) -> bool {
    use std::io::{Error, ErrorKind};
    let is_full = |e: &Error| matches!(e.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded);
    error.chain().any(|cause| {
        let saved = cause.downcast_ref::<SaveError>().map(|e| &e.cause);
        saved.or(cause.downcast_ref()).is_some_and(is_full)
    })
}
