//! What this process's threads had of the processors, as the system counts it.

/// Seconds of all threads together. They grow; 0 where the system does not tell (only Linux does).
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuTimes {
    /// On a processor.
    pub running: f64,
    /// In line for one, ready to run.
    pub waiting: f64,
}

impl CpuTimes {
    /// Up to now.
    pub fn now() -> CpuTimes {
        let mut shares = CpuTimes::default();
        let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return shares };
        for task in tasks.flatten() {
            let Ok(text) = std::fs::read_to_string(task.path().join("schedstat")) else { continue };
            // Nanoseconds on a processor, nanoseconds waiting for one, turns.
            let mut numbers = text.split_whitespace().map_while(|word| word.parse::<u64>().ok());
            shares.running += numbers.next().unwrap_or(0) as f64 * 1e-9;
            shares.waiting += numbers.next().unwrap_or(0) as f64 * 1e-9;
        }
        shares
    }

    /// From `before` to now.
    pub fn since(before: CpuTimes) -> CpuTimes {
        let now = CpuTimes::now();
        // A thread that ended takes its share with it.
        CpuTimes {
            running: (now.running - before.running).max(0.0),
            waiting: (now.waiting - before.waiting).max(0.0),
        }
    }
}
