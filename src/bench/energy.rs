//! Energy counters of the processor packages (RAPL), as Linux publishes them in `/sys/class/powercap`.

use std::path::{Path, PathBuf};

/// Where Linux lists the counters.
const POWERCAP: &str = "/sys/class/powercap";

/// The energy counters of all processor packages. Most systems let only root read them.
///
/// They count the energy of the whole package: all its cores and caches, and whatever else runs there.
#[derive(Clone, Debug)]
pub struct EnergyMeter {
    counters: Vec<EnergyCounter>,
}

/// The counter of a package in microjoules, which wraps around.
#[derive(Clone, Debug)]
struct EnergyCounter {
    file: PathBuf,
    /// The largest value.
    range: u64,
}

/// Values of all counters at a time, in microjoules.
#[derive(Clone, Debug)]
pub struct EnergyReading(Vec<u64>);

impl EnergyMeter {
    /// The counters of this machine. `None` where there are none or they cannot be read.
    pub fn open() -> Option<EnergyMeter> {
        EnergyMeter::in_folder(Path::new(POWERCAP))
    }

    fn in_folder(folder: &Path) -> Option<EnergyMeter> {
        let mut counters = Vec::new();
        for zone in std::fs::read_dir(folder).ok()?.flatten() {
            // Packages are `intel-rapl:0`; `intel-rapl:0:0` is a part of one. AMD's have the same names.
            let name = zone.file_name();
            let is_package = name.to_str().and_then(|name| name.strip_prefix("intel-rapl:"));
            if is_package.is_none_or(|number| number.parse::<u32>().is_err()) {
                continue;
            }
            // `psys` is the whole platform and contains the packages.
            let kind = std::fs::read_to_string(zone.path().join("name")).ok()?;
            if !kind.starts_with("package") {
                continue;
            }
            let range = read_number(&zone.path().join("max_energy_range_uj"))?;
            counters.push(EnergyCounter { file: zone.path().join("energy_uj"), range });
        }
        let meter = EnergyMeter { counters };
        (!meter.counters.is_empty() && meter.read().is_some()).then_some(meter)
    }

    /// Reads the counters.
    pub fn read(&self) -> Option<EnergyReading> {
        let values = self.counters.iter().map(|counter| read_number(&counter.file));
        values.collect::<Option<Vec<u64>>>().map(EnergyReading)
    }

    /// The energy in joules from one reading to a later one, if no counter wraps around more than once.
    pub fn joules(&self, from: &EnergyReading, to: &EnergyReading) -> f64 {
        let difference = |(counter, (from, to)): (&EnergyCounter, (&u64, &u64))| match to.checked_sub(*from) {
            Some(difference) => difference,
            None => counter.range.saturating_sub(*from).saturating_add(*to),
        };
        let microjoules = self.counters.iter().zip(from.0.iter().zip(&to.0)).map(difference);
        microjoules.fold(0, u64::saturating_add) as f64 * 1e-6
    }
}

fn read_number(file: &Path) -> Option<u64> {
    std::fs::read_to_string(file).ok()?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn zone(root: &Path, folder: &str, name: &str, energy: u64) {
        let folder = root.join(folder);
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("name"), format!("{name}\n")).unwrap();
        fs::write(folder.join("energy_uj"), format!("{energy}\n")).unwrap();
        fs::write(folder.join("max_energy_range_uj"), "1000000\n").unwrap();
    }

    #[test]
    fn packages_are_summed_and_counters_wrap_around() {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        assert!(
            EnergyMeter::in_folder(root).is_none() && EnergyMeter::in_folder(&root.join("none")).is_none()
        );
        zone(root, "intel-rapl:0", "package-0", 400_000);
        zone(root, "intel-rapl:0:0", "core", 1);
        zone(root, "intel-rapl:1", "package-1", 900_000);
        zone(root, "intel-rapl:2", "psys", 5);
        let meter = EnergyMeter::in_folder(root).unwrap();
        let from = meter.read().unwrap();
        zone(root, "intel-rapl:0", "package-0", 700_000);
        zone(root, "intel-rapl:1", "package-1", 100_000);
        let to = meter.read().unwrap();
        assert!((meter.joules(&from, &to) - 0.5).abs() < 1e-12, "{}", meter.joules(&from, &to));
        fs::write(root.join("intel-rapl:0/energy_uj"), "unreadable").unwrap();
        assert!(meter.read().is_none() && EnergyMeter::in_folder(root).is_none());
    }
}
