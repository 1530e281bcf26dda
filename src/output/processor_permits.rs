//! Permits to use a processor. A thread returns its permit while it waits for the disk, so that a few threads more than
//! processors keep all of them busy.

use std::cell::RefCell;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

/// A number of permits, each for a thread at work.
#[derive(Debug)]
pub struct ProcessorPermits {
    free: Mutex<usize>,
    returned: Condvar,
}

thread_local! {
    /// The permits of which this thread holds one.
    static HELD: RefCell<Option<Arc<ProcessorPermits>>> = const { RefCell::new(None) };
}

impl ProcessorPermits {
    /// Creates permits for `count` threads.
    pub fn new(count: usize) -> Arc<ProcessorPermits> {
        Arc::new(ProcessorPermits { free: Mutex::new(count), returned: Condvar::new() })
    }

    /// Waits for a permit, and does work while holding it.
    pub fn run<T>(self: &Arc<Self>, work: impl FnOnce() -> T) -> T {
        self.acquire();
        HELD.set(Some(self.clone()));
        let _returned_at_the_end = HeldPermit;
        work()
    }

    fn acquire(&self) {
        let free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let wait = self.returned.wait_while(free, |free| *free == 0);
        *wait.unwrap_or_else(PoisonError::into_inner) -= 1;
    }

    fn release(&self) {
        *self.free.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        self.returned.notify_one();
    }
}

/// Returns the permit of this thread when it is dropped, also after a panic.
struct HeldPermit;

impl Drop for HeldPermit {
    fn drop(&mut self) {
        if let Some(permits) = HELD.take() {
            permits.release();
        }
    }
}

/// Calls a function that waits for the disk. Meanwhile, another thread has the permit of this one.
pub(super) fn wait_for_disk<T>(wait: impl FnOnce() -> T) -> T {
    let Some(permits) = HELD.take() else { return wait() };
    permits.release();
    let result = wait();
    permits.acquire();
    HELD.set(Some(permits));
    result
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::thread;

    use super::*;

    #[test]
    fn threads_at_work_are_no_more_than_permits() {
        let permits = ProcessorPermits::new(2);
        let (working, most, waiting) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(0));
        let work = || {
            most.fetch_max(working.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            thread::yield_now();
            working.fetch_sub(1, Ordering::SeqCst);
        };
        thread::scope(|scope| {
            for _ in 0..5 {
                scope.spawn(|| {
                    for _ in 0..100 {
                        permits.run(|| {
                            work();
                            // All five wait at some time, beyond the permits.
                            wait_for_disk(|| waiting.fetch_add(1, Ordering::SeqCst));
                            work();
                        });
                    }
                });
            }
        });
        assert_eq!(waiting.into_inner(), 500);
        assert!((1..=2).contains(&most.into_inner()));
        assert_eq!(*permits.free.lock().unwrap(), 2);
    }

    #[test]
    fn a_panic_returns_the_permit() {
        let permits = ProcessorPermits::new(1);
        let panicked = thread::scope(|scope| scope.spawn(|| permits.run(|| panic!("on purpose"))).join());
        assert!(panicked.is_err());
        assert_eq!(permits.run(|| 7), 7);
        assert_eq!(wait_for_disk(|| 8), 8, "without a permit");
    }
}
