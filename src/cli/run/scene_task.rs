//! The scenes of a run as jobs of a scheduler.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result, anyhow};

use super::files_version::FilesVersion;
use super::full_disk::is_disk_full;
use super::ledger::{ImageCounts, SceneKey};
use super::panics;
use super::progress::SceneLog;
use super::report_section::ReportSection;
use super::scene_job::SceneJob;
use crate::plan::{ClipFrames, NumberedScene, RenderPlan};
use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_core::worded;
use blinn_import::LoadError;
use blinn_output::ShardPart;
use blinn_scene::ClipBoundsCache;
use blinn_session::{Claim, FileDigests, Job, Permit, SessionError, load_limits};

/// A scene that is to be rendered.
pub struct SceneTask<'a> {
    pub plan: &'a RenderPlan,
    pub scene: NumberedScene,
    pub log: SceneLog<'a>,
    /// The scene in the ledger, if there is one.
    pub key: Option<SceneKey>,
    /// The page that shows its images.
    pub page: Option<PathBuf>,
    /// The archive that its images go into.
    pub archive: Option<PathBuf>,
    /// Time that it may take.
    pub timeout: Option<Duration>,
    pub cancel: CancelToken,
    /// True if the batch ended before the scene did.
    pub is_late: AtomicBool,
}

/// A scene that was rendered or has failed.
pub struct RenderedScene {
    pub outcome: Result<()>,
    pub images: ImageCounts,
    /// The version of its files, for the ledger.
    pub files_version: Option<FilesVersion>,
    /// Its frames, if they depend on it.
    pub clip: Option<ClipFrames>,
    /// Its images on the page.
    pub section: Option<ReportSection>,
    /// Its part of the archive.
    pub part: Option<ShardPart>,
    /// The files that it was made from; empty if it was not read.
    pub files: Vec<PathBuf>,
    /// All its images, if they are compared with golden ones and known.
    pub checked: Option<Vec<PathBuf>>,
}

impl RenderedScene {
    /// True if the scene was given up because the batch ended on a full disk.
    pub fn is_given_up(&self) -> bool {
        self.outcome.as_ref().is_err_and(|error| is_cancellation(error) || is_disk_full(error))
    }
}

impl SceneTask<'_> {
    fn is_late(&self) -> bool {
        self.is_late.load(Ordering::Relaxed)
    }

    fn render(&self, permit: &Arc<Permit>) -> RenderedScene {
        let mut rendered = RenderedScene {
            outcome: Ok(()),
            images: ImageCounts::default(),
            files_version: None,
            clip: None,
            section: self.page.as_deref().map(ReportSection::new),
            part: None,
            files: Vec::new(),
            checked: None,
        };
        if let Some(archive) = &self.archive {
            match ShardPart::new(archive).with_context(|| format!("{} cannot be written", archive.display()))
            {
                Ok(part) => rendered.part = Some(part),
                Err(error) => return RenderedScene { outcome: Err(error), ..rendered },
            }
        }
        let NumberedScene { number: index, ref path } = self.scene;
        let plan = &*self.plan.of_scene(path);
        let mut job = SceneJob {
            plan,
            index,
            path,
            log: &self.log,
            report: rendered.section.as_mut(),
            part: rendered.part.as_mut(),
            digests: FileDigests::with_limit(load_limits(plan.session.max_memory).file_bytes),
            frames: Vec::new(),
            images: ImageCounts::default(),
            cancel: self.cancel.clone(),
            permit,
            views_shown: BTreeMap::new(),
            clip_bounds: ClipBoundsCache::cancelled_by(&self.cancel),
            scene_files: Vec::new(),
            clip: None,
        };
        let outcome = panics::catch(|| job.run());
        rendered.images = job.images;
        // Taken at once: until the scene is reported, which waits for those before it, others may replace its files.
        if self.key.is_some() && self.archive.is_none() && outcome.is_ok() {
            let images = job.images.rendered + job.images.kept;
            let clip = job.clip.unwrap_or(ClipFrames::FROM_ONE);
            let frames = self.plan.frames.with_count(images, clip);
            rendered.files_version = FilesVersion::of_scene(self.plan, path, index, &frames);
            rendered.clip = job.clip;
        }
        rendered.files = std::mem::take(&mut job.scene_files);
        if plan.check.is_some() {
            let frames = std::mem::take(&mut job.frames);
            let frames = Some(frames).filter(|frames| !frames.is_empty()).or_else(|| plan.frames.known());
            rendered.checked = frames.map(|frames| plan.output_files(path, index, &frames));
        }
        rendered.outcome = match self.timeout {
            Some(timeout) if !self.is_late() && outcome.as_ref().is_err_and(is_cancellation) => {
                Err(timeout_error(timeout))
            }
            _ => outcome,
        };
        rendered
    }
}

impl Job for SceneTask<'_> {
    type Output = RenderedScene;

    fn claim(&self) -> Claim {
        let frames = self.plan.frames.known().map(|frames| frames.len());
        self.plan.session.scene_claim(&self.scene.path, frames)
    }

    fn run(&self, permit: &Arc<Permit>) -> RenderedScene {
        let since = Instant::now();
        let rendered = self.render(permit);
        self.log.trace("scene", since.elapsed(), "");
        if self.is_late() && rendered.is_given_up() {
            self.log.clear();
        }
        rendered
    }

    fn begin_again(&self) {
        self.log.clear();
    }

    fn begin_turn(&self) {
        self.log.begin_turn();
    }

    fn has_run_for(&self, time: Duration) {
        if self.timeout.is_some_and(|timeout| time >= timeout) {
            self.cancel.cancel();
        }
    }

    fn ends_batch(&self, rendered: &RenderedScene) -> bool {
        rendered.outcome.as_ref().is_err_and(is_disk_full)
    }

    fn cancel(&self) {
        self.is_late.store(true, Ordering::Relaxed);
        self.cancel.cancel();
    }
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
    anyhow!(worded!(
        "gave up after {} s; raise `timeout`, or make the scene or its images smaller",
        timeout.as_secs_f64()
    ))
}
