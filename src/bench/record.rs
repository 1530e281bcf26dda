//! The measurements of a scene while the rounds go on.

use super::interleaved_timer::Timing;
use super::results::{BvhResults, SceneResults, StageResults};
use super::stage::BenchStage;
use super::stage_record::{StageKey, StageRecord, StageWork};
use super::work_hash::WorkHash;
use super::workload::Workload;
use blinn_import::LoadError;
use blinn_render::Cancelled;
use blinn_scene::{PoseError, ViewError};

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
    /// A stage had other results than before.
    #[error(
        "{} at {width}x{height} pixels: the results with {threads} threads differ from those before (hash {found} \
         instead of {expected}); report this as a defect of blinn or of the machine",
        stage.name()
    )]
    DifferentWork {
        /// The stage.
        stage: BenchStage,
        /// The width of the image in pixels.
        width: u32,
        /// The height of the image in pixels.
        height: u32,
        /// The number of threads.
        threads: usize,
        /// The hash of the first results.
        expected: WorkHash,
        /// The hash of these results.
        found: WorkHash,
    },
    /// The observer rejected the scene.
    #[error("{0}")]
    Rejected(String),
}

/// The measurements of a scene so far.
#[derive(Default)]
pub(super) struct SceneRecord {
    /// Triangles, once a round has built the BVHs.
    pub triangles: Option<u64>,
    pub bvh: BvhResults,
    stages: Vec<StageRecord>,
    pub failure: Option<MeasureError>,
}

impl SceneRecord {
    /// Returns true if no round has failed, and at least one was measured.
    pub fn is_measured(&self) -> bool {
        self.failure.is_none() && self.triangles.is_some()
    }

    /// Adds a round of a stage.
    ///
    /// # Errors
    /// The hash of the results differs from that of an earlier round or of another number of threads.
    pub fn add(&mut self, key: StageKey, work: StageWork, timing: Timing) -> Result<(), MeasureError> {
        let same_work = |record: &&StageRecord| {
            let other = StageKey { threads: key.threads, ..record.key };
            other == key && record.work.hash.is_some()
        };
        let first = self.stages.iter().find(same_work);
        if let (Some(expected), Some(found)) = (first.and_then(|record| record.work.hash), work.hash)
            && expected != found
        {
            let StageKey { threads, size, stage, .. } = key;
            let (width, height) = size.unwrap_or_default();
            return Err(MeasureError::DifferentWork { stage, width, height, threads, expected, found });
        }
        let steps = first.and_then(|record| record.work.steps);
        match self.stages.iter_mut().find(|record| record.key == key) {
            Some(record) => record.rounds.push(timing),
            None => {
                let work = StageWork { steps: work.steps.or(steps), ..work };
                self.stages.push(StageRecord { key, work, rounds: vec![timing] });
            }
        }
        Ok(())
    }

    /// Summarizes the rounds of all stages.
    pub fn results(&self, workload: &Workload) -> SceneResults {
        let mut records: Vec<&StageRecord> = self.stages.iter().collect();
        records.sort_by_key(|record| record.key);
        let results = |record: &StageRecord| {
            let camera = record.key.camera.and_then(|i| workload.cameras.get(i));
            StageResults::new(record, camera.map(|camera| camera.name.as_str()))
        };
        SceneResults {
            name: workload.name.clone(),
            sha256: workload.sha256.clone(),
            triangles: self.triangles.unwrap_or(0),
            tree: Some(self.bvh.clone()),
            stages: records.into_iter().map(results).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Another hash in a later round, or on another number of threads, is an error; other sizes and stages have hashes of
    /// their own.
    #[test]
    fn a_different_hash_is_an_error() {
        let mut record = SceneRecord::default();
        let key = |threads, size, stage| StageKey { threads, camera: None, size: Some((size, size)), stage };
        let work = |bit| StageWork { hash: Some(WorkHash::of_occlusion(&[bit])), ..StageWork::default() };
        let timing = Timing::untimed(None);
        record.add(key(1, 8, BenchStage::Eye), work(true), timing).unwrap();
        record.add(key(1, 8, BenchStage::Eye), work(true), timing).unwrap();
        record.add(key(1, 16, BenchStage::Eye), work(false), timing).unwrap();
        record.add(key(1, 8, BenchStage::Sun), work(false), timing).unwrap();
        for threads in [1, 2] {
            let error = record.add(key(threads, 8, BenchStage::Eye), work(false), timing).unwrap_err();
            let message = error.to_string();
            assert!(message.starts_with("eye at 8x8 pixels: the results with"), "{message}");
        }
        assert_eq!(record.results(&Workload::file("a".as_ref())).stages.len(), 3);
    }
}
