//! The ledger of a plan: which scenes are skipped, and the totals of the others.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;

use super::dataset_files::has_bop_files;
use super::files_version::FilesVersion;
use super::ledger::{ImageCounts, Ledger, LedgerEntry, LedgerLine, PastOutcome, SceneKey};
use crate::args::ProcessArgs;
use crate::args::values::DatasetFormat;
use crate::plan::RenderPlan;
use crate::scene_file::is_stdin;
use crate::summary::Summary;
use blinn_session::{PlannedFrame, SettingsHash, format_bytes};

/// The ledger of a plan.
pub struct SceneLedger<'a> {
    plan: &'a RenderPlan,
    ledger: Ledger,
    settings: SettingsHash,
    /// True to skip scenes that failed before.
    skips_failed: bool,
    since: Instant,
    /// Images of all scenes of this run that are complete.
    images: ImageCounts,
    /// Images and lines of scenes whose archive is not complete.
    pending: PendingScenes,
}

/// Scenes that are not in the ledger yet.
#[derive(Default)]
struct PendingScenes {
    images: ImageCounts,
    lines: Vec<PendingLine>,
}

/// The line of a scene whose archive is not complete.
struct PendingLine {
    path: PathBuf,
    index: usize,
    line: LedgerLine,
    /// True if the ledger has the scene as done, in the archive as it was.
    is_noted: bool,
}

impl PendingScenes {
    fn add(&mut self, entry: &LedgerEntry, is_noted: bool) {
        if !is_noted {
            self.images.add_images(entry.images);
        }
        let (path, index) = (entry.scene.to_path_buf(), entry.index);
        self.lines.push(PendingLine { path, index, line: entry.to_line(), is_noted });
    }
}

impl<'a> SceneLedger<'a> {
    /// Opens the ledger of `--ledger`; `None` without it and for `--dry-run`.
    ///
    /// # Errors
    /// As [`Ledger::open`].
    pub fn open(plan: &'a RenderPlan, process: &ProcessArgs) -> Result<Option<SceneLedger<'a>>> {
        let Some(path) = process.ledger.as_deref().filter(|_| !plan.dry_run) else { return Ok(None) };
        let ledger = Ledger::open(path, plan.outputs.resume, plan.outputs.replace)?;
        Ok(Some(SceneLedger {
            plan,
            ledger,
            settings: plan.scene_settings_hash(),
            skips_failed: process.no_retry,
            since: Instant::now(),
            images: ImageCounts::default(),
            pending: PendingScenes::default(),
        }))
    }

    /// The key of the `index`-th scene, from 1.
    pub fn key(&self, path: &Path, index: usize) -> SceneKey {
        let settings = match self.plan.scene_plan(path) {
            Some(own) => SettingsHash::of(&(self.settings, own)),
            None => self.settings,
        };
        SceneKey::new(self.plan, settings, path, index)
    }

    /// The outcome for which a scene is skipped: done, if its files are there as they were written, or failed, with
    /// `--no-retry`.
    pub fn skips(&self, key: SceneKey, path: &Path, index: usize) -> Option<PastOutcome> {
        if is_stdin(path) {
            return None;
        }
        self.ledger.past(key).filter(|outcome| match *outcome {
            PastOutcome::Done { images, clip, files } => {
                self.has_files(path, index, &self.plan.frames.with_count(images, clip), files)
            }
            PastOutcome::Failed => self.skips_failed,
        })
    }

    /// Returns true if the files of a scene exist, in the version that a line names.
    fn has_files(
        &self,
        path: &Path,
        index: usize,
        frames: &[PlannedFrame],
        files: Option<FilesVersion>,
    ) -> bool {
        let plan = self.plan;
        let found = FilesVersion::of_scene(plan, path, index, frames);
        found.is_some_and(|found| files.is_none_or(|files| files == found))
            && (plan.session.dataset.is_none()
                || !plan.formats.has(DatasetFormat::Bop)
                || has_bop_files(plan, path, index, frames))
    }

    /// Adds a line about a scene, and appends it unless the images go into an archive.
    ///
    /// # Errors
    /// As [`Ledger::append`].
    pub fn add(&mut self, entry: &LedgerEntry) -> Result<()> {
        if self.plan.outputs.shards.is_some() {
            self.pending.add(entry, false);
            return Ok(());
        }
        self.images.add_images(entry.images);
        self.ledger.append(&entry.to_line().to_text())
    }

    /// Adds a line about a scene that the ledger has as done, for the case that its archive is replaced.
    pub fn add_noted(&mut self, entry: &LedgerEntry) {
        self.pending.add(entry, true);
    }

    /// Appends the lines of scenes whose archive is complete. `is_new` says that it was written.
    ///
    /// # Errors
    /// As [`Ledger::append`].
    pub fn complete_archive(&mut self, is_new: bool) -> Result<()> {
        let PendingScenes { images, lines } = std::mem::take(&mut self.pending);
        self.images.add_images(images);
        let plan = self.plan;
        // The names of archives of a number of bytes are not known to those who skip scenes.
        let has_version = plan.outputs.shards.as_ref().is_some_and(|shards| shards.max_bytes().is_none());
        let mut text = String::new();
        let mut files = None;
        for PendingLine { path, index, mut line, is_noted } in lines {
            if is_noted && !(is_new && has_version) {
                continue;
            }
            if has_version {
                // All of them are in the same archive.
                files = files.or_else(|| FilesVersion::of_scene(plan, &path, index, &[]));
                if let Some(files) = files {
                    line.set_files(files);
                }
            }
            text += &line.to_text();
        }
        self.ledger.append(&text)
    }

    /// Forgets the scenes whose archive was not written.
    pub fn discard(&mut self) {
        self.pending = PendingScenes::default();
    }

    /// One line about all scenes of this run.
    pub fn totals(&self, summary: &Summary) -> String {
        let Summary { scenes, failed, skipped_done, skipped_failed, not_written, not_started, .. } = *summary;
        let mut parts = vec![format!("{} done", scenes.saturating_sub(failed + not_written))];
        for (count, what) in [
            (failed, "failed"),
            (skipped_done, "done before"),
            (skipped_failed, "failed before"),
            (not_written, "not written"),
            (not_started, "not started"),
        ] {
            if count > 0 {
                parts.push(format!("{count} {what}"));
            }
        }
        let total = scenes + skipped_done + skipped_failed + not_started;
        let ImageCounts { rendered, kept, empty, files, bytes } = self.images;
        let kept = if kept > 0 { format!(", {kept} kept") } else { String::new() };
        let empty = if empty > 0 { format!(", {empty} of them empty") } else { String::new() };
        let seconds = self.since.elapsed().as_secs_f64();
        format!(
            "scenes: {total}: {}; images: {rendered}{empty}{kept}; {files} files, {}, {seconds:.1} s",
            parts.join(", "),
            format_bytes(bytes)
        )
    }
}
