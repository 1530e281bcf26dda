//! The scenes of a run: each is rendered, reported and noted in the ledger.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use anyhow::{Context, Error, Result};

use super::archive_index::write_archive_index;
use super::golden_check::GoldenNames;
use super::ledger::{ImageCounts, LedgerEntry, PastOutcome};
use super::merged_dataset::{merged_files, write_merged};
use super::progress::{Reporter, SceneLog};
use super::report::Report;
use super::scene_ledger::SceneLedger;
use super::scene_task::{RenderedScene, SceneTask};
use crate::console::{print_stdout, scene_error, single_line};
use crate::plan::{ArchiveFolder, ClipFrames, NumberedScene, RenderPlan};
use crate::summary::Summary;
use blinn_core::cancellation::CancelToken;
use blinn_core::worded;
use blinn_output::ShardPart;
use blinn_session::{Finished, Job, Scheduler};

/// Scenes that are rendered side by side.
pub type Scenes<'s, 'scope, 'a> = Scheduler<'s, 'scope, SceneTask<'a>>;

/// Scenes that are rendered, or wait for it, or for an earlier one to be reported, per thread.
const SCENES_PER_THREAD: usize = 4;

/// The scenes of a run, and what is written about them.
pub struct Batch<'a> {
    pub plan: &'a RenderPlan,
    pub reporter: &'a Reporter,
    pub report: Option<Report>,
    pub ledger: Option<SceneLedger<'a>>,
    /// Time that a scene may take.
    pub timeout: Option<Duration>,
    pub summary: &'a mut Summary,
    /// Number of scenes that were rendered for an archive that is not complete.
    pub in_archive: usize,
    /// The files that the last scene was made from; empty if it was not read.
    pub scene_files: Vec<PathBuf>,
    /// The golden images of the scenes so far.
    pub goldens: GoldenNames,
}

impl<'a> Batch<'a> {
    /// Starts to render a scene. Its images go into files or, if that is named, an archive.
    pub fn start<'scope>(
        &self,
        scenes: &mut Scenes<'_, 'scope, 'a>,
        scene: NumberedScene,
        archive: Option<&Path>,
    ) where
        'a: 'scope,
    {
        let Batch { plan, reporter, timeout, .. } = *self;
        let NumberedScene { number, ref path } = scene;
        let mut log = SceneLog::of_batch(reporter, number, path, plan.strict);
        if self.report.is_some() || self.ledger.is_some() {
            log = log.collecting();
        }
        scenes.push(SceneTask {
            plan,
            log,
            key: self.ledger.as_ref().map(|ledger| ledger.key(path, number)),
            page: self.report.as_ref().map(|report| report.path().to_path_buf()),
            archive: archive.map(Path::to_path_buf),
            timeout,
            cancel: CancelToken::new(),
            is_late: AtomicBool::new(false),
            scene,
        });
    }

    /// Reports a scene that was rendered or has failed. Returns its images if they go into an archive.
    pub fn finish_scene(&mut self, finished: Finished<SceneTask>) -> Result<Option<ShardPart>> {
        let Finished { job, output, time } = finished;
        let RenderedScene { outcome, images, files_version, clip, section, part, files, checked } = output;
        self.goldens.add(checked.as_deref());
        let SceneTask { scene: NumberedScene { number: index, path }, log, key, .. } = &*job;
        self.scene_files = files;
        let failure = outcome.as_ref().err().map(|error| single_line(&scene_error(path, error)));
        log.scene_done();
        let warnings = log.finish();
        if let Some(line) = &failure {
            self.reporter.fail(Some(path), line);
        }
        let failure_line = failure.as_deref();
        if let Some((page, section)) = self.report.as_mut().zip(section)
            && let Err(error) =
                page.add_scene(path, section.finish(), &warnings, images.kept as usize, failure_line)
        {
            // Images are rendered without the page.
            fail(self.summary, self.reporter, &Error::new(error).context(worded!("`report`")));
            self.report = None;
        }
        if let Some(key) = *key {
            let entry = LedgerEntry {
                key,
                scene: path,
                index: *index,
                failure: failure_line,
                warnings: &warnings,
                time,
                images,
                clip,
                files: files_version,
            };
            self.write_ledger(|ledger| ledger.add(&entry));
        }
        self.summary.add_scene(failure);
        self.in_archive += usize::from(part.is_some() && outcome.is_ok());
        outcome.map(|()| part)
    }

    /// Notes in the ledger that the images of an archive are complete. `is_new` says that it was written.
    pub fn complete_archive(&mut self, is_new: bool) {
        self.in_archive = 0;
        self.write_ledger(|ledger| ledger.complete_archive(is_new));
    }

    /// Counts the scenes of an archive that was not written, and forgets their lines.
    pub fn give_up_archive(&mut self) {
        self.summary.not_written += std::mem::take(&mut self.in_archive);
        if let Some(ledger) = &mut self.ledger {
            ledger.discard();
        }
    }

    /// Writes to the ledger, if there is one. If that fails, images are rendered without it.
    fn write_ledger(&mut self, write: impl FnOnce(&mut SceneLedger<'a>) -> Result<()>) {
        if let Some(ledger) = &mut self.ledger
            && let Err(error) = write(ledger)
        {
            fail(self.summary, self.reporter, &error.context(worded!("`ledger`")));
            self.ledger = None;
        }
    }

    /// The outcome for which the ledger skips a scene.
    pub fn past_outcome(&self, NumberedScene { number, path }: &NumberedScene) -> Option<PastOutcome> {
        let ledger = self.ledger.as_ref()?;
        ledger.skips(ledger.key(path, *number), path, *number)
    }

    /// Counts a scene whose outcome is known.
    pub fn skip(&mut self, scene: &NumberedScene, outcome: PastOutcome) {
        self.goldens.add(None);
        match outcome {
            PastOutcome::Done { .. } => self.summary.skipped_done += 1,
            PastOutcome::Failed => self.summary.skipped_failed += 1,
        }
        self.reporter.scene_done(scene.number, &scene.path);
    }

    /// Counts a scene whose images are in an archive of an earlier run, and notes it in the ledger unless that has it as done
    /// and the archive stays as it is.
    pub fn keep(&mut self, scene: &NumberedScene, images: u64, past: Option<PastOutcome>) {
        let NumberedScene { number, path } = scene;
        self.write_ledger(|ledger| {
            let entry = LedgerEntry {
                key: ledger.key(path, *number),
                scene: path,
                index: *number,
                failure: None,
                warnings: &[],
                time: Duration::ZERO,
                images: ImageCounts { kept: images, ..ImageCounts::default() },
                clip: None,
                files: None,
            };
            match past {
                Some(PastOutcome::Done { .. }) => {
                    ledger.add_noted(&entry);
                    Ok(())
                }
                _ => ledger.add(&entry),
            }
        });
        self.skip(scene, PastOutcome::Done { images, clip: ClipFrames::FROM_ONE, files: None });
    }

    /// Writes the files that scenes of a dataset have in common, or prints their names in a dry run.
    fn finish_dataset(&self) -> Result<()> {
        if self.plan.dry_run {
            let archives = self.plan.archive_folder();
            let merged = merged_files(self.plan).context(worded!("`merge`"))?;
            let files = archives.iter().flat_map(ArchiveFolder::files).chain(merged);
            let lines = files.map(|file| format!("{}\n", file.display()));
            return print_stdout(lines.collect::<String>().as_bytes());
        }
        let mut written = write_merged(self.plan, self.reporter).context(worded!("`merge`"))?;
        written.extend(write_archive_index(self.plan, self.reporter).context(worded!("`dataset`"))?);
        written.iter().for_each(|file| self.reporter.wrote(None, file));
        Ok(())
    }

    /// Writes the page and the totals.
    pub fn finish(self) {
        let is_whole = self.plan.is_whole_batch() && self.summary.left() == 0;
        if let Some(check) = self.plan.check.as_ref().filter(|_| is_whole) {
            self.goldens.warn(check, self.reporter);
        }
        if self.summary.left() == 0
            && let Err(error) = self.finish_dataset()
        {
            fail(self.summary, self.reporter, &error);
        }
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

/// True if there are enough scenes to keep all threads busy.
pub fn is_queue_full<'scope, J: Job + 'scope>(scenes: &Scheduler<'_, 'scope, J>) -> bool {
    scenes.len() >= SCENES_PER_THREAD * rayon::current_num_threads()
}

/// Reports an error that belongs to no scene.
pub fn fail(summary: &mut Summary, reporter: &Reporter, error: &Error) {
    reporter.fail(None, &single_line(&format!("{error:#}")));
    summary.other_failure = true;
}
