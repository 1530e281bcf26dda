//! Scheduling statistics of this process: how long its threads ran and how long they waited for a processor.

/// Sums over all threads in seconds. They only grow. 0 on systems other than Linux.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuTimes {
    /// On a processor.
    pub running: f64,
    /// Ready to run, without a processor.
    pub waiting: f64,
}

impl CpuTimes {
    /// The sums until now.
    pub fn now() -> CpuTimes {
        let mut times = CpuTimes::default();
        let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return times };
        for task in tasks.flatten() {
            let Ok(text) = std::fs::read_to_string(task.path().join("schedstat")) else { continue };
            // Nanoseconds running, nanoseconds waiting, time slices.
            let mut numbers = text.split_whitespace().map_while(|word| word.parse::<u64>().ok());
            times.running += numbers.next().unwrap_or(0) as f64 * 1e-9;
            times.waiting += numbers.next().unwrap_or(0) as f64 * 1e-9;
        }
        times
    }

    /// The difference between now and `start`.
    pub fn since(start: CpuTimes) -> CpuTimes {
        let now = CpuTimes::now();
        // The times of a thread vanish when it ends.
        CpuTimes {
            running: (now.running - start.running).max(0.0),
            waiting: (now.waiting - start.waiting).max(0.0),
        }
    }
}
