//! What machine this is.

use sysinfo::{CpuRefreshKind, MemoryRefreshKind, RefreshKind, System};

use super::figures::Machine;
use crate::accel::Tier;

impl Machine {
    /// The machine that this runs on, as far as it tells.
    pub fn here() -> Machine {
        let asked = RefreshKind::nothing()
            .with_cpu(CpuRefreshKind::nothing())
            .with_memory(MemoryRefreshKind::nothing().with_ram());
        let system = System::new_with_specifics(asked);
        let cpu = system.cpus().first().map(|cpu| cpu.brand().trim().to_string());
        let known = |text: Option<String>| text.filter(|text| !text.is_empty());
        Machine {
            cpu: known(cpu).unwrap_or_else(|| std::env::consts::ARCH.to_string()),
            cores: system.cpus().len().try_into().unwrap_or(u32::MAX),
            memory_bytes: system.total_memory(),
            os: known(System::long_os_version()).unwrap_or_else(|| std::env::consts::OS.to_string()),
            kernel: known(System::kernel_version()).unwrap_or_default(),
            simd: Tier::best().name().to_string(),
        }
    }
}
