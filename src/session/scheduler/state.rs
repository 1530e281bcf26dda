//! The jobs of a scheduler, and the threads that they claim.

use std::collections::VecDeque;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use super::memory_pool::{MemoryPool, Permit};

/// Work that is done side by side with other jobs.
pub trait Job: Send + Sync {
    /// The result of the work.
    type Output: Send;

    /// Returns what the job takes while it runs. It is asked once.
    fn claim(&self) -> Claim;

    /// Does the work. Where `permit` was not extended, the result is dropped, and the job runs again.
    fn run(&self, permit: &Arc<Permit>) -> Self::Output;

    /// Undoes what a run has left behind whose result was dropped.
    fn begin_again(&self) {}

    /// Begins the turn of the job: all jobs before it are finished and were handed over.
    fn begin_turn(&self) {}

    /// Takes note of the time that the job has run so far: see [`Finished::time`](super::Finished::time).
    fn has_run_for(&self, time: Duration) {
        let _ = time;
    }

    /// Returns true if no later job should begin after one with this result.
    fn ends_batch(&self, output: &Self::Output) -> bool {
        let _ = output;
        false
    }

    /// Ends the work early: its result is not needed any more.
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
    pub claim: Claim,
    pub step: Step<J::Output>,
    /// Time that the job has run: while others run beside it, its share by threads.
    pub time: Duration,
    /// True after [`Job::begin_turn`].
    pub has_turn: bool,
}

impl<J: Job> Slot<J> {
    pub fn is_waiting(&self) -> bool {
        matches!(self.step, Step::Waiting { .. })
    }

    pub fn is_running(&self) -> bool {
        matches!(self.step, Step::Running { .. })
    }

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
    /// Number of the job after which none begins.
    pub last: Option<u64>,
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
            last: None,
            charged: Instant::now(),
        }
    }

    pub fn push(&mut self, job: J) {
        let Claim { threads, memory } = job.claim();
        let slot = Slot {
            number: self.next_number,
            job: Arc::new(job),
            claim: Claim { threads: threads.clamp(1, self.threads), memory },
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
        let running = self.running_threads();
        let position = self.slots.iter().position(Slot::is_waiting)?;
        let slot = &mut self.slots[position];
        if self.last.is_some_and(|last| slot.number > last) {
            return None;
        }
        let must_wait = matches!(slot.step, Step::Waiting { is_deferred: true }) && position > 0;
        if must_wait || (running > 0 && running + slot.claim.threads > self.threads) {
            return None;
        }
        let permit = self.memory.start(slot.number, slot.claim.memory)?;
        slot.step = Step::Running { permit: Arc::downgrade(&permit) };
        Some(Started { number: slot.number, job: slot.job.clone(), permit })
    }

    /// Returns the number of threads that running jobs claim.
    fn running_threads(&self) -> usize {
        self.slots.iter().filter(|slot| slot.is_running()).map(|slot| slot.claim.threads).sum()
    }

    /// Notes the end of the job with a number. If it was deferred, it waits again.
    pub fn finish(&mut self, number: u64, outcome: std::thread::Result<J::Output>, is_deferred: bool) {
        self.charge();
        let Some(slot) = self.slots.iter_mut().find(|slot| slot.number == number) else { return };
        if is_deferred && outcome.is_ok() {
            slot.step = Step::Waiting { is_deferred };
            slot.time = Duration::ZERO;
            return;
        }
        if outcome.as_ref().is_ok_and(|output| slot.job.ends_batch(output)) {
            self.last = Some(self.last.map_or(number, |last| last.min(number)));
        }
        slot.step = Step::Done(outcome);
    }

    /// Divides the time since the last call among the running jobs, in proportion to their threads: as much as they would
    /// have taken one after the other.
    pub fn charge(&mut self) {
        let now = Instant::now();
        let passed = now.saturating_duration_since(self.charged);
        self.charged = now;
        let all = self.running_threads().max(1) as f64;
        for slot in self.slots.iter_mut().filter(|slot| slot.is_running()) {
            slot.time += passed.mul_f64(slot.claim.threads as f64 / all);
        }
    }
}
