//! Runs the jobs of a batch side by side, and hands their results over in order.
//!
//! A job is a scene with all of its images. Who owns the scene, and when its memory is freed:
//!
//! 1. The caller [pushes](Scheduler::push) a job. It waits, and holds no scene yet.
//! 2. A thread of the pool takes the first waiting job as soon as the threads and the memory of its [`Claim`] are free.
//! 3. That thread runs the job and owns its scene. Threads without a job of their own help with its parts.
//! 4. While it is read, the scene claims the memory that it needs ([`Permit::resize`]). The first unfinished job waits
//!    until others have freed enough. Any other gives up its scene ([`Deferred`]), and runs again when it is the first.
//! 5. When the job ends, its scene is freed, and its threads and memory go to the next waiting job.
//! 6. The caller takes results in the order of the jobs ([`Scheduler::next_finished`]). Messages, ledgers and archives
//!    therefore do not depend on which job ended first.

mod memory_pool;
mod queue;
mod state;
#[cfg(test)]
mod tests;

pub use memory_pool::{Deferred, Permit};
#[cfg(test)]
use queue::run_in;
pub use queue::{Finished, Scheduler, run_scheduled};
pub use state::{Capacity, Claim, Job};
