//! The task of rendering one scene of a run, apart from all others.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::{Error, Result, anyhow};

use super::ledger::{ImageCounts, SceneKey};
use super::panics;
use super::progress::{Reporter, SceneLog};
use super::report::ReportSection;
use super::scene_job::SceneJob;
use crate::batch::FileDigests;
use crate::cancellation::{CancelToken, Cancelled};
use crate::cli::plan::{RenderPlan, load_limits};
use crate::import::LoadError;
use crate::output::{SaveError, ShardWriter};
use crate::scene::ClipBoundsCache;

/// A scene to render.
pub struct SceneTask<'a> {
    pub plan: &'a RenderPlan,
    pub reporter: &'a Reporter,
    /// Time that the scene may take.
    pub timeout: Option<Duration>,
    /// The scene's number, from 1.
    pub index: usize,
    pub path: PathBuf,
    /// The key of its line in the ledger.
    pub key: SceneKey,
    /// Its part of the page of `--report`.
    pub section: Option<ReportSection>,
    /// True if the page or the ledger needs its warnings.
    pub collects_warnings: bool,
    /// The archive that its images go into.
    pub archive: Option<PathBuf>,
}

/// A scene that was rendered or failed, and the facts about it.
pub struct RenderedScene {
    /// The scene's number, from 1.
    pub index: usize,
    pub path: PathBuf,
    pub key: SceneKey,
    pub outcome: Result<()>,
    pub images: ImageCounts,
    /// All warnings, if something needs them.
    pub warnings: Vec<String>,
    pub time: Duration,
    /// The files that it was made from; empty if it was not read.
    pub files: Vec<PathBuf>,
    pub section: Option<ReportSection>,
    /// Its images, if they go into an archive and the scene was rendered beside others.
    pub shard: Option<ShardWriter>,
}

impl SceneTask<'_> {
    /// Renders the scene beside others. Images for an archive go into a part of their own.
    pub fn render_apart(self) -> RenderedScene {
        let Some(archive) = self.archive.clone() else { return self.render(None) };
        match ShardWriter::new(&archive) {
            Ok(mut part) => {
                let scene = self.render(Some(&mut part));
                RenderedScene { shard: scene.outcome.is_ok().then_some(part), ..scene }
            }
            Err(cause) => self.fail(SaveError { path: archive, cause }.into()),
        }
    }

    /// The scene with an error that came before it was read.
    fn fail(self, error: Error) -> RenderedScene {
        let SceneTask { reporter, index, path, key, section, .. } = self;
        reporter.scene_done(&path);
        RenderedScene {
            index,
            path,
            key,
            outcome: Err(error),
            images: ImageCounts::default(),
            warnings: Vec::new(),
            time: Duration::ZERO,
            files: Vec::new(),
            section,
            shard: None,
        }
    }

    /// Renders the scene. Images go into `shard`, if there is one.
    pub fn render(self, shard: Option<&mut ShardWriter>) -> RenderedScene {
        let SceneTask { plan, reporter, timeout, index, path, key, section, collects_warnings, .. } = self;
        let since = Instant::now();
        let log = SceneLog::new(reporter, &path, plan.strict);
        let log = if collects_warnings { log.collecting() } else { log };
        let cancel = timeout.map_or_else(CancelToken::default, CancelToken::with_timeout);
        let mut job = SceneJob {
            plan,
            index,
            path: &path,
            log: &log,
            report: section,
            shard,
            digests: FileDigests::with_limit(load_limits(plan.max_memory).file_bytes),
            frames: Vec::new(),
            images: ImageCounts::default(),
            cancel: cancel.clone(),
            views_shown: BTreeMap::new(),
            clip_bounds: ClipBoundsCache::cancelled_by(&cancel),
            scene_files: Vec::new(),
        };
        let outcome = panics::catch(|| job.run());
        let outcome = match timeout {
            Some(timeout) if outcome.as_ref().is_err_and(is_cancellation) => Err(timeout_error(timeout)),
            _ => outcome,
        };
        let SceneJob { images, scene_files: files, report: section, .. } = job;
        reporter.scene_done(&path);
        let warnings = log.finish();
        RenderedScene {
            index,
            path,
            key,
            outcome,
            images,
            warnings,
            time: since.elapsed(),
            files,
            section,
            shard: None,
        }
    }
}

/// Returns true for the error of work that was cancelled.
fn is_cancellation(error: &Error) -> bool {
    let is_load_error = |e: &LoadError| matches!(e, LoadError::Cancelled(_));
    error.chain().any(|cause| cause.is::<Cancelled>() || cause.downcast_ref().is_some_and(is_load_error))
}

fn timeout_error(timeout: Duration) -> Error {
    anyhow!(
        "gave up after {} s; raise --timeout, or make the scene or its images smaller",
        timeout.as_secs_f64()
    )
}
