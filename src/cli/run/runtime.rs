//! Prepares the process for work: signal handlers and the thread pool.

use anyhow::{Result, anyhow};
use rayon::ThreadPoolBuilder;

use super::signals;
use blinn_core::worded;

/// Starts watching for signals and the global thread pool, by default with a thread for each available processor.
///
/// # Errors
/// The system refuses another thread.
pub fn start(threads: Option<u16>) -> Result<()> {
    let error = |cause: String| {
        anyhow!(worded!(
            "no thread could be started: {}; raise the process limit (ulimit -u), or use fewer `threads`",
            cause
        ))
    };
    signals::watch().map_err(|e| error(e.to_string()))?;
    let pool = ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from));
    pool.build_global().map_err(|e| error(e.to_string()))
}
