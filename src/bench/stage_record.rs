//! The measurements of a stage while the rounds go on.

use super::interleaved_timer::Timing;
use super::rays::MeanSteps;
use super::stage::BenchStage;
use super::work_hash::WorkHash;

/// Identifies a measurement: a stage, the number of threads, and the camera and the size of the image for stages that
/// depend on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct StageKey {
    pub threads: usize,
    /// Index in the workload's cameras; `None` for the default view.
    pub camera: Option<usize>,
    /// Width and height in pixels.
    pub size: Option<(u32, u32)>,
    pub stage: BenchStage,
}

/// The work of a stage, the same in each round and for each number of threads.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StageWork {
    /// The number of rays, for stages that only trace.
    pub rays: Option<u64>,
    /// The hash of the results.
    pub hash: Option<WorkHash>,
    /// Traversal steps per ray, counted in the first round.
    pub steps: Option<MeanSteps>,
}

/// The measurements of a stage so far.
pub(super) struct StageRecord {
    pub key: StageKey,
    pub work: StageWork,
    pub rounds: Vec<Timing>,
}
