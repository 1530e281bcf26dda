use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Barrier, Mutex};
use std::time::{Duration, Instant};

use super::*;

/// A job that calls a function.
struct Task<'a> {
    number: usize,
    claim: Claim,
    run: &'a (dyn Fn(usize, &Arc<Permit>) + Sync),
    turns: &'a Mutex<Vec<usize>>,
    is_cancelled: &'a (dyn Fn() + Sync),
    /// How often the job has begun again.
    repeats: AtomicUsize,
    /// True if no job begins after it.
    is_last: bool,
}

impl<'a> Task<'a> {
    fn new(
        number: usize,
        run: &'a (dyn Fn(usize, &Arc<Permit>) + Sync),
        turns: &'a Mutex<Vec<usize>>,
    ) -> Task<'a> {
        let repeats = AtomicUsize::new(0);
        Task { number, claim: SMALL, run, turns, is_cancelled: &|| (), repeats, is_last: false }
    }
}

/// Results of some jobs, in their order.
#[derive(Default)]
struct Results {
    outputs: Vec<usize>,
    times: Vec<Duration>,
    repeats: Vec<usize>,
    turns: Vec<usize>,
}

impl Job for Task<'_> {
    type Output = usize;

    fn claim(&self) -> Claim {
        self.claim
    }

    fn run(&self, permit: &Arc<Permit>) -> usize {
        (self.run)(self.number, permit);
        self.number
    }

    fn begin_again(&self) {
        self.repeats.fetch_add(1, Ordering::SeqCst);
    }

    fn begin_turn(&self) {
        self.turns.lock().unwrap().push(self.number);
    }

    fn ends_batch(&self, _: &usize) -> bool {
        self.is_last
    }

    fn cancel(&self) {
        (self.is_cancelled)();
    }
}

const SMALL: Claim = Claim { threads: 1, memory: 10 };

/// Runs jobs with claims on a pool of `threads`.
fn results(threads: usize, claims: &[Claim], run: &(dyn Fn(usize, &Arc<Permit>) + Sync)) -> Results {
    let turns = Mutex::new(Vec::new());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let capacity = Capacity { threads, memory: 100 };
    let mut results = Results::default();
    run_in(&pool, capacity, |scheduler: &mut Scheduler<'_, '_, Task>| {
        for (number, &claim) in claims.iter().enumerate() {
            scheduler.push(Task { claim, ..Task::new(number, run, &turns) });
        }
        while let Some(Finished { job, output, time }) = scheduler.next_finished() {
            assert_eq!(turns.lock().unwrap().last(), Some(&output), "its turn has begun");
            results.outputs.push(output);
            results.times.push(time);
            results.repeats.push(job.repeats.load(Ordering::SeqCst));
        }
    });
    Results { turns: turns.into_inner().unwrap(), ..results }
}

#[test]
fn results_come_in_order_whichever_job_ends_first() {
    for threads in [1, 2, 5] {
        let sleep = |number: usize, _: &Arc<Permit>| {
            std::thread::sleep(Duration::from_millis(if number.is_multiple_of(3) { 20 } else { 1 }));
        };
        let Results { outputs, times, turns, .. } = results(threads, &[SMALL; 20], &sleep);
        assert_eq!(outputs, (0..20).collect::<Vec<_>>());
        assert_eq!(turns, outputs);
        assert_eq!(times.len(), 20);
    }
}

#[test]
fn jobs_run_side_by_side_as_far_as_threads_and_memory_suffice() {
    let at_once = |threads: usize, claims: &[Claim]| {
        let (running, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let run = |_: usize, _: &Arc<Permit>| {
            most.fetch_max(running.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            std::thread::sleep(Duration::from_millis(5));
            running.fetch_sub(1, Ordering::SeqCst);
        };
        results(threads, claims, &run);
        most.into_inner()
    };
    let claim = |threads, memory| Claim { threads, memory };
    assert_eq!(at_once(1, &[SMALL; 6]), 1);
    assert!(at_once(4, &[SMALL; 40]) <= 4);
    assert!(at_once(4, &[claim(2, 1); 20]) <= 2);
    assert!(at_once(4, &[claim(1, 50); 20]) <= 2);
    assert_eq!(at_once(4, &[claim(1, 101); 6]), 1, "a job that needs more than all memory runs alone");
    assert_eq!(at_once(4, &[claim(99, 1); 6]), 1, "and one that claims more than all threads");
    // Two jobs that wait for each other end only if they run at once.
    let barrier = Barrier::new(2);
    results(2, &[SMALL; 2], &|_, _| {
        barrier.wait();
    });
}

#[test]
fn a_job_that_finds_no_memory_runs_again_when_it_is_the_first() {
    let runs = AtomicUsize::new(0);
    let barrier = Barrier::new(2);
    let run = |number: usize, permit: &Arc<Permit>| {
        let first_run = number == 1 && runs.fetch_add(1, Ordering::SeqCst) == 0;
        if number == 0 {
            barrier.wait();
            // The second job has failed, and waits.
            while runs.load(Ordering::SeqCst) != 99 {
                std::thread::yield_now();
            }
        } else if first_run {
            barrier.wait();
            assert!(!permit.grow(95), "the first job has 10 of 100");
            runs.store(99, Ordering::SeqCst);
        } else {
            assert!(permit.grow(95));
        }
    };
    let Results { outputs, turns, repeats, .. } = results(2, &[SMALL; 2], &run);
    assert_eq!((outputs, turns, repeats), (vec![0, 1], vec![0, 1], vec![0, 1]));
    assert_eq!(runs.into_inner(), 100);
}

#[test]
fn jobs_are_charged_the_time_that_they_would_take_alone() {
    let run = |_: usize, _: &Arc<Permit>| std::thread::sleep(Duration::from_millis(100));
    let since = Instant::now();
    let times = results(4, &[SMALL; 4], &run).times;
    let (all, passed) = (times.iter().sum::<Duration>(), since.elapsed());
    assert!(all <= passed && all >= passed / 2, "{all:?} of {passed:?}");
    assert!(times.iter().all(|time| *time < Duration::from_millis(80)), "{times:?}");
}

#[test]
fn cancelled_jobs_end_and_are_returned_in_order() {
    let is_cancelled = AtomicUsize::new(0);
    let turns = Mutex::new(Vec::new());
    let run = |_: usize, _: &Arc<Permit>| {
        while is_cancelled.load(Ordering::SeqCst) == 0 {
            std::thread::yield_now();
        }
    };
    let cancel = || {
        is_cancelled.fetch_add(1, Ordering::SeqCst);
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    run_in(&pool, Capacity { threads: 2, memory: 100 }, |scheduler: &mut Scheduler<'_, '_, Task>| {
        for number in 0..5 {
            scheduler.push(Task { is_cancelled: &cancel, ..Task::new(number, &run, &turns) });
        }
        while is_cancelled.load(Ordering::SeqCst) == 0 {
            let cancelled = scheduler.cancel();
            assert_eq!(cancelled.iter().map(|job| job.number).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
            if is_cancelled.load(Ordering::SeqCst) == 0 {
                // None had started yet.
                return;
            }
        }
        assert!(scheduler.is_empty());
    });
}

#[test]
fn jobs_that_have_begun_are_handed_over_after_a_stop() {
    let (has_begun, is_cancelled) = (Barrier::new(2), AtomicUsize::new(0));
    let turns = Mutex::new(Vec::new());
    let run = |number: usize, _: &Arc<Permit>| {
        if number == 2 {
            has_begun.wait();
            while is_cancelled.load(Ordering::SeqCst) == 0 {
                std::thread::yield_now();
            }
        }
    };
    let cancel = || {
        is_cancelled.fetch_add(1, Ordering::SeqCst);
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    run_in(&pool, Capacity { threads: 1, memory: 100 }, |scheduler: &mut Scheduler<'_, '_, Task>| {
        for number in 0..5 {
            scheduler.push(Task { is_cancelled: &cancel, ..Task::new(number, &run, &turns) });
        }
        assert_eq!(scheduler.next_finished().map(|finished| finished.output), Some(0));
        has_begun.wait();
        assert_eq!(scheduler.stop(), 2);
        let rest = std::iter::from_fn(|| scheduler.next_finished()).map(|finished| finished.output);
        assert_eq!(rest.collect::<Vec<_>>(), [1, 2]);
    });
    assert_eq!(is_cancelled.into_inner(), 1);
}

#[test]
fn no_job_begins_after_one_that_ends_the_batch() {
    let runs = AtomicUsize::new(0);
    let turns = Mutex::new(Vec::new());
    let run = |_: usize, _: &Arc<Permit>| {
        runs.fetch_add(1, Ordering::SeqCst);
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    run_in(&pool, Capacity { threads: 1, memory: 100 }, |scheduler: &mut Scheduler<'_, '_, Task>| {
        for number in 0..9 {
            scheduler.push(Task { is_last: number == 2, ..Task::new(number, &run, &turns) });
        }
        for number in 0..3 {
            assert_eq!(scheduler.next_finished().map(|finished| finished.output), Some(number));
        }
        assert_eq!(scheduler.cancel().len(), 6);
        // Others may follow after a new start.
        scheduler.push(Task::new(9, &run, &turns));
        assert_eq!(scheduler.next_finished().map(|finished| finished.output), Some(9));
    });
    assert_eq!(runs.into_inner(), 4);
}

#[test]
fn a_panic_reaches_the_caller() {
    let run = |number: usize, _: &Arc<Permit>| assert!(number != 1, "job 1");
    let caught = std::panic::catch_unwind(|| results(2, &[SMALL; 3], &run));
    assert!(caught.is_err());
}
