//! Memory that this process allocates: no mutated file takes more than 256 MiB, and rendered frames leave nothing
//! behind.
//!
//! A binary of its own, because its global allocator counts: other tests in the process would be counted too.
//! Its tests run one at a time for the same reason.
//!
//! - `mutations`: small files of every format with bytes changed and cut off
//! - `soak`: frame after frame in one process

#[path = "../common/mod.rs"]
mod common;

mod mutations;
mod soak;

use std::sync::{Mutex, MutexGuard, PoisonError};

#[global_allocator]
static MEMORY: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

/// Waits until no other test allocates.
fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}
