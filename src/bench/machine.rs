//! The machine and operating system that a benchmark runs on.

use std::fs;

use super::results::Machine;
use blinn_accel::SimdLevel;
use blinn_session::memory;

impl Machine {
    /// Describes this machine. Systems other than Linux report defaults for some fields.
    pub fn detect() -> Machine {
        let cpus = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let cores = cpus.lines().filter(|line| line.starts_with("processor")).count();
        let cores =
            if cores > 0 { cores } else { std::thread::available_parallelism().map_or(1, usize::from) };
        let cpu = cpus.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
        let cpu = cpu.map(|(_, name)| name.trim().to_string()).filter(|name| !name.is_empty());
        let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
        Machine {
            cpu: cpu.unwrap_or_else(|| std::env::consts::ARCH.to_string()),
            cores: cores.try_into().unwrap_or(u32::MAX),
            memory_bytes: memory::total_bytes().unwrap_or(0),
            os: distribution().unwrap_or_else(|| std::env::consts::OS.to_string()),
            kernel: kernel.trim().to_string(),
            simd: SimdLevel::detect().name().to_string(),
        }
    }
}

/// Name and version of a Linux distribution, such as `Linux (Debian GNU/Linux 13)`.
fn distribution() -> Option<String> {
    let release = fs::read_to_string("/etc/os-release").ok()?;
    let value = |key: &str| {
        let value = release.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix('='))?;
        Some(value.trim_matches('"').to_string())
    };
    let name = value("NAME")?;
    Some(match value("VERSION_ID") {
        Some(version) => format!("Linux ({name} {version})"),
        None => format!("Linux ({name})"),
    })
}
