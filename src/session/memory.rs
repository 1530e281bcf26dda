//! Memory of the machine and of this process, read from Linux's `/proc` and control groups. Other systems report
//! nothing.

use std::path::Path;
use std::sync::OnceLock;

/// Physical memory of the machine in bytes.
pub fn total_bytes() -> Option<u64> {
    kilobytes(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemTotal:")
}

/// Bytes that this process may allocate: the machine's memory, or less if a control group or `ulimit` said so when it was
/// first asked. A picture asks several times, and the system takes longer to answer than to read a small scene.
pub fn limit_bytes() -> Option<u64> {
    static LIMIT: OnceLock<Option<u64>> = OnceLock::new();
    *LIMIT.get_or_init(read_limit)
}

fn read_limit() -> Option<u64> {
    let cgroups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let own_cgroup = cgroups.lines().find_map(|line| line.strip_prefix("0::/")).unwrap_or_default();
    // The limits of all parent groups apply, too.
    let cgroup_limits = Path::new(own_cgroup).ancestors().filter_map(|group| {
        let file = Path::new("/sys/fs/cgroup").join(group).join("memory.max");
        std::fs::read_to_string(file).ok()?.trim().parse::<u64>().ok()
    });
    let process_limits = std::fs::read_to_string("/proc/self/limits").unwrap_or_default();
    cgroup_limits.chain(address_space_limits(&process_limits)).chain([total_bytes()?]).min()
}

/// Peak resident memory of this process in bytes, since it started or since [`reset_peak`].
pub fn peak_bytes() -> Option<u64> {
    kilobytes(&std::fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Resets the peak that [`peak_bytes`] returns. Returns false if the system does not allow it.
pub fn reset_peak() -> bool {
    // 5 resets the peak and nothing else (man 5 proc_pid_clear_refs).
    std::fs::write("/proc/self/clear_refs", "5").is_ok()
}

/// The value of a line `KEY   123 kB` in bytes.
fn kilobytes(text: &str, key: &str) -> Option<u64> {
    let value = text.lines().find_map(|line| line.strip_prefix(key))?;
    value.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// Soft limits of address space and data segment in `/proc/self/limits`, in bytes.
fn address_space_limits(limits: &str) -> impl Iterator<Item = u64> {
    let soft_limit = |line: &str| {
        let names = ["Max address space", "Max data size"];
        let values = names.into_iter().find_map(|name| line.strip_prefix(name))?;
        values.split_whitespace().next()?.parse::<u64>().ok()
    };
    limits.lines().filter_map(soft_limit)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn ulimit_bounds_the_memory_of_a_process() {
        let limits = "Limit                     Soft Limit           Hard Limit           Units     \n\
                      Max data size             unlimited            unlimited            bytes     \n\
                      Max processes             1                    2                    processes \n\
                      Max address space         3072000000           unlimited            bytes     \n";
        assert_eq!(address_space_limits(limits).collect::<Vec<_>>(), [3_072_000_000]);
    }

    #[test]
    fn this_process_takes_less_than_its_limit() {
        let (limit, peak) = (limit_bytes().unwrap(), peak_bytes().unwrap());
        assert!(peak > 1 << 20 && limit > peak, "{peak} of {limit}");
    }
}
