//! Limits for reading files.

use crate::memory::limit_bytes;
use blinn_import::Limits;

/// Limits within `max_memory` bytes, else within the memory that this process may allocate.
pub fn load_limits(max_memory: Option<u64>) -> Limits {
    let available = || Limits { memory_bytes: limit_bytes().unwrap_or(u64::MAX), ..Limits::default() };
    max_memory.map_or_else(available, Limits::with_memory)
}
