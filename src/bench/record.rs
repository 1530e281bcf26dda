//! The measurements of a scene while the rounds go on.

use super::interleaved_timer::Timing;
use super::results::{BenchStage, BvhResults, SceneResults, StageResults};
use crate::import::LoadError;
use crate::render::Cancelled;
use crate::scene::{PoseError, ViewError};

/// Why a scene could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// It cannot be imported.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// It cannot be posed.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// It has no valid camera.
    #[error(transparent)]
    View(#[from] ViewError),
    /// An image cannot be encoded.
    #[error("an image cannot be encoded: {0}")]
    Encode(#[from] std::io::Error),
    /// A frame was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The threads cannot be created.
    #[error("cannot start {threads} threads: {cause}; use fewer")]
    Threads {
        /// Their number.
        threads: usize,
        /// The reason.
        cause: rayon::ThreadPoolBuildError,
    },
    /// The observer rejected the scene.
    #[error("{0}")]
    Rejected(String),
}

/// The measurements of a scene so far.
#[derive(Default)]
pub(super) struct SceneRecord {
    pub triangles: u64,
    pub bvh: BvhResults,
    stages: Vec<StageRecord>,
    pub failure: Option<MeasureError>,
}

/// The measurements of a stage so far.
struct StageRecord {
    stage: BenchStage,
    threads: usize,
    rays: Option<u64>,
    rounds: Vec<Timing>,
}

impl SceneRecord {
    /// Adds a round of a stage.
    pub fn add(&mut self, stage: BenchStage, threads: usize, rays: Option<u64>, timing: Timing) {
        match self.stages.iter_mut().find(|record| (record.stage, record.threads) == (stage, threads)) {
            Some(record) => record.rounds.push(timing),
            None => self.stages.push(StageRecord { stage, threads, rays, rounds: vec![timing] }),
        }
    }

    /// Summarizes the rounds of all stages.
    pub fn results(&self, name: &str) -> SceneResults {
        let summarize = |record: &StageRecord| {
            StageResults::new(record.stage, record.threads, record.rays, &record.rounds)
        };
        let mut stages: Vec<StageResults> = self.stages.iter().map(summarize).collect();
        stages.sort_by_key(|s| (s.threads, s.stage));
        let tree = Some(self.bvh.clone());
        SceneResults { name: name.into(), triangles: self.triangles, tree, stages }
    }
}
