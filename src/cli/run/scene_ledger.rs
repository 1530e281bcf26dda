//! The ledger of a plan: which scenes are skipped, and the totals of the others.

use std::path::Path;
use std::time::Instant;

use anyhow::Result;

use super::dataset_files::has_bop_files;
use super::ledger::{ImageCounts, Ledger, LedgerEntry, PastOutcome, SceneKey};
use crate::args::ProcessArgs;
use crate::args::values::DatasetFormat;
use crate::plan::{RenderPlan, Target};
use crate::scene_file::is_stdin;
use crate::summary::Summary;
use blinn_session::{SettingsHash, format_bytes};

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
    lines: String,
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
        SceneKey::new(self.plan, self.settings, path, index)
    }

    /// The outcome for which a scene is skipped: done, if its files exist, or failed, with `--no-retry`.
    pub fn skips(&self, key: SceneKey, path: &Path, index: usize) -> Option<PastOutcome> {
        if is_stdin(path) {
            return None;
        }
        self.ledger.past(key).filter(|outcome| match *outcome {
            PastOutcome::Done { images } => self.has_files(path, index, images),
            PastOutcome::Failed => self.skips_failed,
        })
    }

    fn has_files(&self, path: &Path, index: usize, images: u64) -> bool {
        let plan = self.plan;
        let is_stdout = |frame| plan.outputs.target(path, index, frame) == Target::Stdout;
        let frames = plan.frames.with_count(images);
        let files = plan.output_files(path, index, &frames);
        !frames.iter().any(is_stdout)
            && files.iter().all(|file| file.is_file())
            && (plan.session.dataset.is_none()
                || !plan.formats.has(DatasetFormat::Bop)
                || has_bop_files(plan, path, index, &frames))
    }

    /// Adds a line about a scene, and appends it unless the images go into an archive.
    ///
    /// # Errors
    /// As [`Ledger::append`].
    pub fn add(&mut self, entry: &LedgerEntry) -> Result<()> {
        self.pending.images.add_images(entry.images);
        self.pending.lines += &entry.to_line();
        if self.plan.outputs.shards.is_none() { self.append() } else { Ok(()) }
    }

    /// Appends the lines of scenes whose images are complete.
    ///
    /// # Errors
    /// As [`Ledger::append`].
    pub fn append(&mut self) -> Result<()> {
        let PendingScenes { images, lines } = std::mem::take(&mut self.pending);
        self.images.add_images(images);
        self.ledger.append(&lines)
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
