//! The memory that running jobs share.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A job that has to run again when it is the first, because the memory that it needs is taken by others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the scene is read again when there is memory for it")]
pub struct Deferred;

/// Longest wait between two looks for work of other threads.
const PAUSE: Duration = Duration::from_millis(2);

/// Bytes of memory, and the running jobs that claim them.
#[derive(Debug)]
pub(super) struct MemoryPool {
    total: u64,
    claims: Mutex<Claims>,
    freed: Condvar,
}

#[derive(Debug, Default)]
struct Claims {
    /// Bytes by number of job.
    bytes: BTreeMap<u64, u64>,
    /// True while the first job waits for memory.
    is_awaited: bool,
}

impl Claims {
    /// Bytes that all jobs but one claim.
    fn of_others(&self, job: u64) -> u64 {
        self.bytes.iter().filter(|(other, _)| **other != job).fold(0, |sum, (_, b)| sum.saturating_add(*b))
    }

    /// True if no other job claims memory, or `bytes` are left beside the others.
    fn fit(&self, job: u64, bytes: u64, total: u64) -> bool {
        self.bytes.keys().all(|other| *other == job) || self.of_others(job).saturating_add(bytes) <= total
    }
}

impl MemoryPool {
    pub fn new(total: u64) -> MemoryPool {
        MemoryPool { total, claims: Mutex::default(), freed: Condvar::new() }
    }

    /// Claims memory for a job that is to start. A job that is alone gets any amount. `None` if there is too little.
    pub fn start(self: &Arc<MemoryPool>, job: u64, bytes: u64) -> Option<Arc<Permit>> {
        let mut claims = self.lock();
        if claims.is_awaited || !claims.fit(job, bytes, self.total) {
            return None;
        }
        claims.bytes.insert(job, bytes);
        Some(Arc::new(Permit { pool: self.clone(), job, is_deferred: AtomicBool::new(false) }))
    }

    /// Changes the claim of a running job. The job of the lowest number waits for others to end.
    fn resize(&self, job: u64, bytes: u64) -> Result<(), Deferred> {
        let mut claims = self.lock();
        while !claims.fit(job, bytes, self.total) {
            if claims.bytes.keys().next() != Some(&job) {
                return Err(Deferred);
            }
            claims.is_awaited = true;
            drop(claims);
            // Helps others meanwhile.
            let has_helped = rayon::yield_now() == Some(rayon::Yield::Executed);
            claims = self.lock();
            if !has_helped {
                let waited = self.freed.wait_timeout(claims, PAUSE);
                claims = waited.unwrap_or_else(PoisonError::into_inner).0;
            }
        }
        claims.is_awaited = false;
        claims.bytes.insert(job, bytes);
        Ok(())
    }

    fn release(&self, job: u64) {
        self.lock().bytes.remove(&job);
        self.freed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, Claims> {
        self.claims.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The memory of a running job, which it frees when it is dropped.
#[derive(Debug)]
pub struct Permit {
    pool: Arc<MemoryPool>,
    job: u64,
    is_deferred: AtomicBool,
}

impl Permit {
    /// Returns a permit for a job that runs alone, with any amount of memory.
    pub fn alone() -> Arc<Permit> {
        let pool = Arc::new(MemoryPool::new(u64::MAX));
        Arc::new(Permit { pool, job: 0, is_deferred: AtomicBool::new(false) })
    }

    /// Claims `bytes`, if the job claims less so far. Returns false if others need the memory, and the job has to end.
    pub fn grow(&self, bytes: u64) -> bool {
        let claimed = self.pool.lock().bytes.get(&self.job).copied();
        claimed.is_some_and(|claimed| bytes <= claimed) || self.resize(bytes).is_ok()
    }

    /// Changes the bytes that the job claims.
    ///
    /// # Errors
    /// Others need the memory, and the job has to end.
    pub fn resize(&self, bytes: u64) -> Result<(), Deferred> {
        let resized = self.pool.resize(self.job, bytes);
        if resized.is_err() {
            self.is_deferred.store(true, Ordering::Relaxed);
        }
        resized
    }

    /// True after [`Permit::resize`] has failed: whatever the job returns is not its result.
    pub fn is_deferred(&self) -> bool {
        self.is_deferred.load(Ordering::Relaxed)
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        self.pool.release(self.job);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jobs_start_while_there_is_memory() {
        let pool = Arc::new(MemoryPool::new(100));
        let alone = pool.start(1, 1000);
        assert!(alone.is_some(), "a job that is alone gets any amount");
        assert!(pool.start(2, 1).is_none());
        drop(alone);
        let first = pool.start(2, 60).unwrap();
        assert!(pool.start(3, 41).is_none());
        let second = pool.start(3, 40).unwrap();
        assert_eq!(second.resize(41), Err(Deferred));
        assert!(second.is_deferred() && !first.is_deferred());
        assert_eq!(first.resize(20), Ok(()));
        assert_eq!(second.resize(80), Ok(()));
    }

    #[test]
    fn the_first_job_waits_for_others_and_none_starts_meanwhile() {
        let pool = Arc::new(MemoryPool::new(100));
        let first = pool.start(1, 10).unwrap();
        let second = pool.start(2, 50).unwrap();
        std::thread::scope(|scope| {
            let grown = scope.spawn(|| first.resize(90));
            while !pool.lock().is_awaited {
                std::thread::yield_now();
            }
            assert!(pool.start(3, 1).is_none());
            drop(second);
            assert_eq!(grown.join().unwrap(), Ok(()));
        });
        assert!(pool.start(3, 10).is_some());
    }
}
