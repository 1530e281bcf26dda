//! The memory that all scenes share.

use crate::memory_limit::load_limits;
use crate::plan::SessionPlan;
use blinn_import::Limits;
use blinn_scene::Environment;

/// The program itself, and a thread with its working memory.
const CODE: u64 = 40 << 20;
const THREAD: u64 = 1 << 20;

/// Bytes of the program itself with the threads of the current pool.
pub(crate) fn program_bytes() -> u64 {
    CODE + THREAD * rayon::current_num_threads() as u64
}

impl SessionPlan {
    /// Bytes that are taken before a scene is read: by the program itself, with the threads of the current pool, and by the
    /// environment of the options.
    pub(crate) fn shared_bytes(&self) -> u64 {
        let environment = self.options.lighting.environment.as_ref();
        program_bytes() + environment.map_or(0, Environment::memory_size)
    }

    /// Limits for reading a scene beside what all scenes share.
    pub fn scene_limits(&self) -> Limits {
        Limits { taken_bytes: self.shared_bytes(), ..load_limits(self.max_memory) }
    }
}
