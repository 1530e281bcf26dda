//! The scheduler: jobs go in, results come out in the same order.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rayon::Scope;

use super::state::{Capacity, Job, Slot, State, Step};

/// Time between two looks at the clocks of jobs.
const TICK: Duration = Duration::from_millis(10);

thread_local! {
    /// True on a thread that runs a job. While the job waits for parts that other threads work on, the thread may do parts of
    /// any job, but begins none.
    static HAS_JOB: Cell<bool> = const { Cell::new(false) };
}

/// Calls `work` with a scheduler, whose jobs run on the current pool of threads. Jobs that were not handed over when `work`
/// ends are cancelled.
///
/// Has to be called from outside of the pool, whose threads all work on jobs.
pub fn run_scheduled<'scope, J: Job + 'scope, R>(
    capacity: Capacity,
    work: impl FnOnce(&mut Scheduler<'_, 'scope, J>) -> R,
) -> R {
    rayon::in_place_scope(|scope| run_in_scope(scope, capacity, work))
}

/// [`run_scheduled`] on any pool of threads.
#[cfg(test)]
pub(super) fn run_in<'scope, J: Job + 'scope, R>(
    pool: &rayon::ThreadPool,
    capacity: Capacity,
    work: impl FnOnce(&mut Scheduler<'_, 'scope, J>) -> R,
) -> R {
    pool.in_place_scope(|scope| run_in_scope(scope, capacity, work))
}

fn run_in_scope<'scope, J: Job + 'scope, R>(
    scope: &Scope<'scope>,
    capacity: Capacity,
    work: impl FnOnce(&mut Scheduler<'_, 'scope, J>) -> R,
) -> R {
    let shared = Arc::new(Shared {
        state: Mutex::new(State::new(capacity)),
        changed: Condvar::new(),
        is_called: AtomicBool::new(false),
    });
    let mut scheduler = Scheduler { shared, scope };
    let result = catch_unwind(AssertUnwindSafe(|| work(&mut scheduler)));
    drop(scheduler.cancel());
    result.unwrap_or_else(|panic| resume_unwind(panic))
}

/// Runs jobs side by side.
pub struct Scheduler<'a, 'scope, J: Job> {
    shared: Arc<Shared<J>>,
    scope: &'a Scope<'scope>,
}

/// A job that has ended.
pub struct Finished<J: Job> {
    /// The job.
    pub job: Arc<J>,
    /// Its result.
    pub output: J::Output,
    /// Time that the job would have taken without others beside it: while several run, each is charged its share.
    pub time: Duration,
}

struct Shared<J: Job> {
    state: Mutex<State<J>>,
    /// A job has ended.
    changed: Condvar,
    /// True if threads were called to take jobs, and none has come yet.
    is_called: AtomicBool,
}

impl<'scope, J: Job + 'scope> Scheduler<'_, 'scope, J> {
    /// Number of jobs that were not handed over.
    pub fn len(&self) -> usize {
        self.shared.lock().slots.len()
    }

    /// True if all jobs were handed over.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds a job behind all others.
    pub fn push(&mut self, job: J) {
        self.shared.lock().push(job);
        self.call_threads();
    }

    /// Waits for the first job. `None` if there is none.
    ///
    /// # Panics
    /// If the job has panicked.
    pub fn next_finished(&mut self) -> Option<Finished<J>> {
        let mut state = self.shared.lock();
        loop {
            let first = state.slots.front_mut()?;
            if !first.has_turn && first.is_kept() {
                first.has_turn = true;
                let job = first.job.clone();
                drop(state);
                job.begin_turn();
                state = self.shared.lock();
                continue;
            }
            if matches!(first.step, Step::Done(_)) {
                break;
            }
            state.charge();
            let running = state.slots.iter().filter(|slot| slot.is_running());
            running.for_each(|slot| slot.job.has_run_for(slot.time));
            let has_waiting = state.slots.iter().any(Slot::is_waiting);
            drop(state);
            if has_waiting {
                self.call_threads();
            }
            let waited = self.shared.changed.wait_timeout(self.shared.lock(), TICK);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        let slot = state.slots.pop_front()?;
        drop(state);
        self.call_threads();
        match slot.step {
            Step::Done(Ok(output)) => Some(Finished { job: slot.job, output, time: slot.time }),
            Step::Done(Err(panic)) => resume_unwind(panic),
            Step::Waiting { .. } | Step::Running { .. } => None,
        }
    }

    /// Begins no further job and cancels those that run. Jobs that have begun are still handed over, whatever their result.
    /// Returns the number of the others.
    pub fn stop(&mut self) -> usize {
        let mut state = self.shared.lock();
        state.slots.iter().filter(|slot| slot.is_running()).for_each(|slot| slot.job.cancel());
        let all = state.slots.len();
        loop {
            // A job that gave up does not run again.
            state.slots.retain(|slot| !slot.is_waiting());
            if !state.slots.iter().any(Slot::is_running) {
                return all - state.slots.len();
            }
            state = self.shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Ends all jobs, and returns them in their order.
    pub fn cancel(&mut self) -> Vec<Arc<J>> {
        let mut state = self.shared.lock();
        let jobs = state.slots.iter().map(|slot| slot.job.clone()).collect();
        state.slots.retain(Slot::is_running);
        state.slots.iter().for_each(|slot| slot.job.cancel());
        loop {
            // A job that gave up does not run again.
            state.slots.retain(Slot::is_running);
            if state.slots.is_empty() {
                state.last = None;
                return jobs;
            }
            state = self.shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Calls all threads of the pool that have no job to take one.
    fn call_threads(&self) {
        if !self.shared.is_called.swap(true, Ordering::AcqRel) {
            let shared = self.shared.clone();
            self.scope.spawn_broadcast(move |_, _| shared.work());
        }
    }
}

impl<J: Job> Shared<J> {
    /// Runs jobs on this thread while some can start.
    fn work(&self) {
        self.is_called.store(false, Ordering::Release);
        if HAS_JOB.replace(true) {
            return;
        }
        loop {
            let Some(started) = self.lock().start() else { break };
            let outcome = catch_unwind(AssertUnwindSafe(|| started.job.run(&started.permit)));
            let is_deferred = started.permit.is_deferred();
            if is_deferred {
                started.job.begin_again();
            }
            // Frees the memory of the job before others look for it.
            drop(started.permit);
            self.lock().finish(started.number, outcome, is_deferred);
            self.changed.notify_all();
        }
        HAS_JOB.set(false);
    }

    fn lock(&self) -> MutexGuard<'_, State<J>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
