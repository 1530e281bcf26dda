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
        let cpu = cpu_field(&cpus, "model name");
        let kernel = fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default();
        Machine {
            cpu: cpu.unwrap_or_else(|| std::env::consts::ARCH.to_string()),
            cpu_model: cpu_model(&cpus).unwrap_or_default(),
            cores: cores.try_into().unwrap_or(u32::MAX),
            memory_bytes: memory::total_bytes().unwrap_or(0),
            os: distribution().unwrap_or_else(|| std::env::consts::OS.to_string()),
            kernel: kernel.trim().to_string(),
            simd: SimdLevel::detect().name().to_string(),
        }
    }

    /// Returns the processor's name with its model, if that is known: `AMD EPYC (family 25, model 1)`.
    pub fn processor(&self) -> String {
        if self.cpu_model.is_empty() {
            return self.cpu.clone();
        }
        format!("{} ({})", self.cpu, self.cpu_model)
    }
}

/// A field of the first processor in Linux's `/proc/cpuinfo`.
fn cpu_field(cpus: &str, name: &str) -> Option<String> {
    let fields = cpus.lines().filter_map(|line| line.split_once(':'));
    let value =
        fields.map(|(field, value)| (field.trim(), value.trim())).find(|(field, _)| *field == name)?.1;
    Some(value.to_string()).filter(|value| !value.is_empty())
}

/// Family and model of the first processor in Linux's `/proc/cpuinfo`.
fn cpu_model(cpus: &str) -> Option<String> {
    Some(format!("family {}, model {}", cpu_field(cpus, "cpu family")?, cpu_field(cpus, "model")?))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_those_of_the_first_processor() {
        let cpus = "processor\t: 0\ncpu family\t: 25\nmodel\t\t: 1\nmodel name\t: AMD EPYC\n\nprocessor\t: 1\nmodel\t\t: 2\n";
        assert_eq!(cpu_model(cpus).as_deref(), Some("family 25, model 1"));
        assert_eq!(cpu_field(cpus, "model name").as_deref(), Some("AMD EPYC"));
        assert_eq!(cpu_model("Features\t: fp asimd\n"), None);
    }
}
