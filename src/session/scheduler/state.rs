//! The jobs of a scheduler, and the threads that they claim.

use std::collections::VecDeque;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use super::memory_pool::{Deferred, MemoryPool, Permit};

/// Work that is done side by side with other jobs.
pub trait Job: Send + Sync {
    /// The result of the work.
    type Output: Send;

    /// Returns what the job takes while it runs.
    fn claim(&self) -> Claim;

    /// Does the work.
    ///
    /// # Errors
    /// `permit` was not extended, and the job has to run again.
    fn run(&self, permit: &Arc<Permit>) -> Result<Self::Output, Deferred>;

    /// All jobs before this one are finished and were handed over.
    fn begin_turn(&self) {}

    /// The job runs for `time` now: see [`Finished::time`](super::Finished::time).
    fn at_time(&self, time: Duration) {
        let _ = time;
    }

    /// The result is not needed any more.
    fn cancel(&self);
}

/// Threads and memory that a job takes while it runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Claim {
    /// Threads that have enough to do with it, at least 1.
    pub threads: usize,
    /// Bytes of memory when it starts.
    pub memory: u64,
}

/// Threads and memory that all running jobs together may take. A job that is alone takes what it needs.
#[derive(Clone, Copy, Debug)]
pub struct Capacity {
    /// Threads of the pool.
    pub threads: usize,
    /// Bytes of memory.
    pub memory: u64,
}

/// A job on its way through the scheduler.
pub(super) struct Slot<J: Job> {
    /// Counts all jobs.
    pub number: u64,
    pub job: Arc<J>,
    pub step: Step<J::Output>,
    /// Time that the job has run, and its threads while others run, too.
    pub time: Duration,
    /// True after [`Job::begin_turn`].
    pub has_turn: bool,
}

impl<J: Job> Slot<J> {
    /// True if the job will not be given up, as far as is known. If no earlier job runs, that does not change.
    pub fn is_kept(&self) -> bool {
        match &self.step {
            Step::Running { permit, .. } => permit.upgrade().is_some_and(|permit| !permit.is_deferred()),
            Step::Waiting { .. } | Step::Done(_) => true,
        }
    }
}

/// State of a job.
pub(super) enum Step<T> {
    Waiting {
        /// True if it ran already, and runs again when it is the first.
        is_deferred: bool,
    },
    Running {
        threads: usize,
        permit: Weak<Permit>,
    },
    /// The job has ended, or it panicked.
    Done(std::thread::Result<T>),
}

/// All jobs that are not handed over, in order.
pub(super) struct State<J: Job> {
    pub slots: VecDeque<Slot<J>>,
    pub memory: Arc<MemoryPool>,
    threads: usize,
    next_number: u64,
    /// The time up to which jobs have been charged.
    charged: Instant,
}

/// A job that was taken to be run.
pub(super) struct Started<J> {
    pub number: u64,
    pub job: Arc<J>,
    pub permit: Arc<Permit>,
}

impl<J: Job> State<J> {
    pub fn new(capacity: Capacity) -> State<J> {
        State {
            slots: VecDeque::new(),
            memory: Arc::new(MemoryPool::new(capacity.memory)),
            threads: capacity.threads.max(1),
            next_number: 0,
            charged: Instant::now(),
        }
    }

    pub fn push(&mut self, job: J) {
        let slot = Slot {
            number: self.next_number,
            job: Arc::new(job),
            step: Step::Waiting { is_deferred: false },
            time: Duration::ZERO,
            has_turn: false,
        };
        self.next_number += 1;
        self.slots.push_back(slot);
    }

    /// Takes the first waiting job if there are threads and memory for it. No job overtakes another.
    pub fn start(&mut self) -> Option<Started<J>> {
        self.charge();
        let is_waiting = |slot: &Slot<J>| matches!(slot.step, Step::Waiting { .. });
        let running = self.running_threads();
        let memory = self.memory.clone();
        let is_first = self.slots.iter().position(is_waiting)? == 0;
        let slot = self.slots.iter_mut().find(|slot| is_waiting(slot))?;
        let Claim { threads, memory: bytes } = slot.job.claim();
        let threads = threads.clamp(1, self.threads);
        let must_wait = matches!(slot.step, Step::Waiting { is_deferred: true }) && !is_first;
        if must_wait || (running > 0 && running + threads > self.threads) {
            return None;
        }
        let permit = memory.start(slot.number, bytes)?;
        slot.step = Step::Running { threads, permit: Arc::downgrade(&permit) };
        Some(Started { number: slot.number, job: slot.job.clone(), permit })
    }

    /// True if a job could start.
    pub fn has_waiting(&self) -> bool {
        self.slots.iter().any(|slot| matches!(slot.step, Step::Waiting { .. }))
    }

    pub fn running_threads(&self) -> usize {
        let threads =
            |slot: &Slot<J>| if let Step::Running { threads, .. } = slot.step { threads } else { 0 };
        self.slots.iter().map(threads).sum()
    }

    /// The job with a number has ended.
    pub fn finish(&mut self, number: u64, outcome: std::thread::Result<Result<J::Output, Deferred>>) {
        self.charge();
        let Some(slot) = self.slots.iter_mut().find(|slot| slot.number == number) else { return };
        slot.step = match outcome {
            Ok(Ok(output)) => Step::Done(Ok(output)),
            Ok(Err(Deferred)) => Step::Waiting { is_deferred: true },
            Err(panic) => Step::Done(Err(panic)),
        };
        if matches!(slot.step, Step::Waiting { .. }) {
            slot.time = Duration::ZERO;
        }
    }

    /// Divides the time since the last call among the running jobs, in proportion to their threads: as much as they would
    /// have taken one after the other.
    pub fn charge(&mut self) {
        let now = Instant::now();
        let passed = now.saturating_duration_since(self.charged);
        self.charged = now;
        let all = self.running_threads();
        for slot in &mut self.slots {
            if let Step::Running { threads, .. } = slot.step {
                slot.time += passed.mul_f64(threads as f64 / all.max(1) as f64);
            }
        }
    }
}
