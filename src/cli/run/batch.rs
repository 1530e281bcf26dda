//! The scenes of a run: each is rendered, reported and noted in the ledger.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Error, Result};

use super::ledger::{LedgerEntry, PastOutcome};
use super::progress::Reporter;
use super::report::Report;
use super::scene_ledger::SceneLedger;
use super::scene_task::{RenderedScene, SceneTask};
use crate::cli::console::{scene_error, single_line};
use crate::cli::plan::RenderPlan;
use crate::cli::summary::Summary;
use crate::output::{SaveError, ShardWriter};

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
}

impl<'a> Batch<'a> {
    /// Renders a scene and reports its outcome, unless the ledger has it. A scene that fails has no images in the archive.
    pub fn render_scene(&mut self, index: usize, path: &Path) -> Result<()> {
        let Some(task) = self.task(index, path) else { return Ok(()) };
        let start = self.shard.as_ref().map_or(0, ShardWriter::length);
        let rendered = task.render(self.shard.as_mut());
        if rendered.outcome.is_err() {
            self.end_shard_at(start);
        }
        self.add(rendered)
    }

    /// Returns the task of rendering a scene. Counts a scene that the ledger has, and returns `None`.
    pub fn task(&mut self, index: usize, path: &Path) -> Option<SceneTask<'a>> {
        let key = self.ledger.as_ref().map(|ledger| ledger.key(path, index)).unwrap_or_default();
        // An archive is made as a whole.
        let ledger = self.ledger.as_ref().filter(|_| self.shard.is_none());
        if let Some(outcome) = ledger.and_then(|ledger| ledger.skips(key, path, index)) {
            self.skip(path, outcome);
            return None;
        }
        Some(SceneTask {
            plan: self.plan,
            reporter: self.reporter,
            timeout: self.timeout,
            index,
            path: path.to_path_buf(),
            key,
            section: self.report.as_ref().map(|report| report.section(path)),
            collects_warnings: self.report.is_some() || self.ledger.is_some(),
            archive: self.shard.as_ref().map(|shard| shard.path().to_path_buf()),
        })
    }

    /// Reports the outcome of a scene.
    pub fn add(&mut self, scene: RenderedScene) -> Result<()> {
        let RenderedScene { index, path, key, outcome, images, warnings, time, files, section, shard } =
            scene;
        let outcome = outcome.and_then(|()| self.append_to_shard(shard));
        self.scene_files = files;
        let failure = outcome.as_ref().err().map(|error| single_line(&scene_error(&path, error)));
        if let Some(line) = &failure {
            self.reporter.fail(Some(&path), line);
        }
        if let (Some(page), Some(section)) = (&mut self.report, section)
            && let Err(error) = page.add_section(section, &warnings, images.kept as usize, failure.as_deref())
        {
            // Images are rendered without the page.
            fail(self.summary, self.reporter, &Error::new(error).context("--report"));
            self.report = None;
        }
        let failure_line = failure.as_deref();
        let entry = LedgerEntry {
            key,
            scene: &path,
            index,
            failure: failure_line,
            warnings: &warnings,
            time,
            images,
        };
        if let Some(ledger) = &mut self.ledger
            && let Err(error) = ledger.add(&entry)
        {
            // Images are rendered without the ledger.
            fail(self.summary, self.reporter, &error.context("--ledger"));
            self.ledger = None;
        }
        self.summary.add_scene(failure);
        outcome
    }

    /// Appends the images of a scene to the archive.
    fn append_to_shard(&mut self, part: Option<ShardWriter>) -> Result<()> {
        let (Some(shard), Some(part)) = (&mut self.shard, part) else { return Ok(()) };
        let start = shard.length();
        let appended = shard.append(part).map_err(|cause| SaveError { path: shard.path().into(), cause });
        if appended.is_err() {
            self.end_shard_at(start);
        }
        Ok(appended?)
    }

    /// Removes what follows the first `length` bytes of the archive. If that fails, the archive is given up.
    fn end_shard_at(&mut self, length: u64) {
        if self.shard.as_mut().is_some_and(|shard| shard.truncate(length).is_err()) {
            self.shard = None;
        }
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

/// The end of a run or of a part of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunEnd {
    /// All scenes were rendered or failed.
    Complete,
    /// Nothing more can be written. The error was reported.
    DiskFull,
}

impl RunEnd {
    /// The end after an error.
    pub fn of(error: Option<&Error>) -> RunEnd {
        if error.is_some_and(is_disk_full) { RunEnd::DiskFull } else { RunEnd::Complete }
    }
}

/// Reports an error that belongs to no scene.
pub fn fail(summary: &mut Summary, reporter: &Reporter, error: &Error) {
    reporter.fail(None, &single_line(&format!("{error:#}")));
    summary.other_failure = true;
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
