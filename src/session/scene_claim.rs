//! Threads and memory that the scenes of a batch claim before they are read.

use std::path::Path;

use crate::plan::SessionPlan;
use crate::scheduler::{Capacity, Claim};

/// Seconds that a thread takes for a sample of a pixel, roughly.
const SAMPLE: f64 = 0.5e-6;
/// Seconds that a thread takes to read a byte of a scene and to build its part of the BVH, roughly.
const BYTE: f64 = 20e-9;
/// Seconds of work for which a further thread is worth its cost. Smaller scenes are rendered side by side instead.
const THREAD: f64 = 1.0;

impl SessionPlan {
    /// The threads and the memory that a scene claims when it starts, by the size of its file and its number of frames, if
    /// that is known.
    ///
    /// It never claims more than half of the threads: while a scene is read or its last tiles are rendered, another one
    /// keeps the others busy.
    pub fn scene_claim(&self, file: &Path, frames: Option<usize>) -> Claim {
        let bytes = std::fs::metadata(file).map_or(0, |file| file.len());
        let samples = self.options.planned_samples(frames.unwrap_or(1)) as f64;
        let work = samples * SAMPLE + bytes as f64 * BYTE;
        let most = (rayon::current_num_threads() / 2).max(1);
        Claim { threads: ((work / THREAD) as usize).clamp(1, most), memory: bytes }
    }

    /// Returns what all scenes of a batch together may take: the threads of the current pool, and the memory beside what they
    /// share.
    pub fn capacity(&self) -> Capacity {
        let limits = self.scene_limits();
        let memory = limits.memory_bytes.saturating_sub(limits.taken_bytes);
        Capacity { threads: rayon::current_num_threads(), memory }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Options;

    #[test]
    fn large_scenes_claim_more_threads_but_never_all() {
        let threads = |size, samples, frames| {
            let plan = SessionPlan::new(Options { size: Some(size), samples, ..Options::default() });
            let pool = rayon::ThreadPoolBuilder::new().num_threads(16).build().unwrap();
            pool.install(|| plan.scene_claim(Path::new("none.glb"), frames).threads)
        };
        assert_eq!(threads((256, 256), 4, Some(1)), 1);
        assert_eq!(threads((256, 256), 1, Some(12)), 1);
        assert_eq!(threads((1920, 1080), 4, None), 4);
        assert_eq!(threads((1920, 1080), 16, Some(100)), 8);
    }
}
