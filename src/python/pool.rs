//! The threads that do the work: one rayon pool for each process.
//!
//! A forked child has none of its parent's threads, so a process that was forked starts a pool of its own. Nothing uses
//! rayon's global pool, which would wait for such threads for ever.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::{Result, anyhow};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::errors::{render_error, value_error};
use blinn_cli::embed::catch_panic;

/// Time between checks for Ctrl-C, and between calls of a progress callback.
pub const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// The highest number of threads that [`set_threads`] accepts, as `--threads` does.
const MAX_THREADS: usize = 1024;

struct ProcessPool {
    process: u32,
    pool: Arc<ThreadPool>,
}

static POOL: Mutex<Option<ProcessPool>> = Mutex::new(None);

/// Threads of new pools; 0 for one for each available processor.
static THREADS: AtomicUsize = AtomicUsize::new(0);

/// Set the number of threads that render in this process and in processes that it forks.
///
/// 0, the default, is one for each available processor. Worker processes that render side by side need one each.
#[pyfunction]
pub fn set_threads(count: usize) -> PyResult<()> {
    if count > MAX_THREADS {
        return Err(value_error(format!("count must be at most {MAX_THREADS}, not {count}")));
    }
    THREADS.store(count, Ordering::Relaxed);
    let mut current = POOL.lock().unwrap_or_else(|e| e.into_inner());
    if current.as_ref().is_some_and(|pool| pool.process == std::process::id()) {
        *current = None;
    }
    Ok(())
}

/// The pool of this process.
///
/// # Errors
/// The system refuses another thread.
pub fn current() -> Result<Arc<ThreadPool>> {
    let process = std::process::id();
    let mut current = POOL.lock().unwrap_or_else(|e| e.into_inner());
    if let Some(existing) = current.as_ref().filter(|existing| existing.process == process) {
        return Ok(existing.pool.clone());
    }
    let builder = ThreadPoolBuilder::new().num_threads(THREADS.load(Ordering::Relaxed));
    let pool = builder.thread_name(|i| format!("blinn-{i}")).build();
    let pool = Arc::new(pool.map_err(|e| anyhow!("no thread could be started: {e}"))?);
    // The pool of a parent process has no threads here: dropping it would wait for them for ever.
    std::mem::forget(current.replace(ProcessPool { process, pool: pool.clone() }));
    Ok(pool)
}

/// Calls a function in the pool while other Python threads run.
pub fn run<T: Send>(py: Python<'_>, function: impl FnOnce() -> Result<T> + Send) -> PyResult<T> {
    let pool = current().map_err(|e| render_error(&e))?;
    py.detach(|| pool.install(|| catch_panic(function))).map_err(|e| render_error(&e))
}

/// Calls a function in the pool, and returns early at Ctrl-C. The function then ends unnoticed.
pub fn run_interruptible<T: Send + 'static>(
    py: Python<'_>,
    function: impl FnOnce() -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let pool = current().map_err(|e| render_error(&e))?;
    let (sender, receiver) = sync_channel(1);
    pool.spawn(move || drop(sender.send(catch_panic(function))));
    // `Receiver` must not be shared, but `detach` needs what it captures to be.
    let receiver = Mutex::new(receiver);
    loop {
        let received = py.detach(|| {
            let receiver = receiver.lock().unwrap_or_else(|e| e.into_inner());
            receiver.recv_timeout(POLL_INTERVAL)
        });
        py.check_signals()?;
        match received {
            Ok(outcome) => return outcome.map_err(|e| render_error(&e)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Err(render_error(&anyhow!("cancelled"))),
        }
    }
}
