//! How long this process's threads stood in line for a processor.

/// Seconds that all threads of this process have waited, ready to run, while others had the processors.
/// Grows; 0 where the system does not tell (only Linux does).
pub fn waited() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let of_task = |task: std::fs::DirEntry| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        // Nanoseconds on a processor, nanoseconds waiting for one, turns.
        text.split_whitespace().nth(1)?.parse::<u64>().ok()
    };
    tasks.flatten().filter_map(of_task).sum::<u64>() as f64 * 1e-9
}
