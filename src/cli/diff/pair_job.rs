//! A pair of scenes as a job of a scheduler.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Result;
use serde_json::Value;

use super::{heading, overwrite, prepare_output, scenes, text, write_output};
use crate::args::DiffArgs;
use crate::plan::RenderPlan;
use crate::run::panics;
use crate::run::progress::SceneLog;
use blinn_core::cancellation::CancelToken;
use blinn_session::{Claim, Job, Permit};

/// Pictures that a pair usually has: two of each of four views.
const PICTURES: usize = 8;

/// Two scenes that are to be compared.
pub struct PairJob<'a> {
    pub args: &'a DiffArgs,
    /// The plan for pictures of any pair.
    pub plan: &'a RenderPlan,
    pub old: &'a Path,
    pub new: &'a Path,
    /// The page or picture to write.
    pub page: Option<PathBuf>,
    /// Logs of the old and the new scene.
    pub logs: [SceneLog<'a>; 2],
    pub cancel: CancelToken,
}

/// The result of a comparison, without its pictures.
pub struct PairReport {
    pub is_different: bool,
    /// The differences on one line; empty if there are none.
    pub summary: String,
    /// The result for --json.
    pub json: Option<Value>,
}

impl PairJob<'_> {
    fn compare(&self, permit: &Arc<Permit>) -> Result<PairReport> {
        let overwrite = overwrite(self.args);
        if let Some(page) = &self.page {
            prepare_output(page, overwrite)?;
        }
        let files = [self.old, self.new];
        let comparison =
            scenes::compare(files, self.plan.clone(), self.args, &self.logs, permit, &self.cancel)?;
        let heading = heading(self.args, files);
        if let Some(page) = &self.page {
            write_output(page, &heading, &comparison, overwrite)?;
            self.logs[0].wrote(page);
        }
        Ok(PairReport {
            is_different: comparison.is_different(),
            summary: text::summary(&comparison),
            json: self.args.json.then(|| text::to_json(&heading, &comparison)),
        })
    }
}

impl Job for PairJob<'_> {
    type Output = Result<PairReport>;

    /// Claims the memory of both files, and the threads of the larger one.
    fn claim(&self) -> Claim {
        let [old, new] = [self.old, self.new].map(|file| self.plan.session.scene_claim(file, Some(PICTURES)));
        Claim { threads: old.threads.max(new.threads), memory: old.memory.saturating_add(new.memory) }
    }

    fn run(&self, permit: &Arc<Permit>) -> Result<PairReport> {
        panics::catch(|| self.compare(permit))
    }

    fn begin_again(&self) {
        self.logs.iter().for_each(SceneLog::clear);
    }

    fn begin_turn(&self) {
        self.logs.iter().for_each(SceneLog::begin_turn);
    }

    fn cancel(&self) {
        self.cancel.cancel();
    }
}
