//! The memory that this process takes, as the system tells it.

/// The most bytes that this process has had at once, since it began or since [`forget_peak`].
pub fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// Lets [`peak`] begin anew. False where the system does not let it.
pub fn forget_peak() -> bool {
    // Linux's way: 5 resets the peak, and nothing else.
    std::fs::write("/proc/self/clear_refs", "5").is_ok()
}
