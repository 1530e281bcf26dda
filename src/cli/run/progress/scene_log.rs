//! Messages about one scene.

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use anyhow::Result;

use super::reporter::Reporter;
use crate::console::strict_error;
use crate::warning_filter::WarningFilter;
use blinn_import::Warning;

/// Reports each warning of a scene once: the first few of each kind and the number of the others. Collects all if a
/// page needs them.
pub struct SceneLog<'a> {
    pub reporter: &'a Reporter,
    scene: &'a Path,
    strict: bool,
    warnings: Mutex<Warnings>,
}

#[derive(Default)]
struct Warnings {
    /// Hashes of all warnings.
    known: HashSet<u64>,
    filter: WarningFilter,
    /// All warnings in order; `None` if nothing needs them.
    collected: Option<Vec<String>>,
}

impl<'a> SceneLog<'a> {
    pub fn new(reporter: &'a Reporter, scene: &'a Path, strict: bool) -> SceneLog<'a> {
        SceneLog { reporter, scene, strict, warnings: Mutex::default() }
    }

    /// Collects all warnings for [`SceneLog::finish`].
    pub fn collecting(self) -> SceneLog<'a> {
        self.warnings().collected = Some(Vec::new());
        self
    }

    /// Reports a warning unless it was reported before. With --strict, returns it as an error.
    pub fn warn(&self, text: &str) -> Result<()> {
        self.warn_of_kind(text, text)
    }

    /// Reports the warnings of an import, then how many of each kind were withheld.
    pub fn warn_of_import(&self, warnings: Vec<Warning>) -> Result<()> {
        for warning in warnings {
            self.warn_of_kind(&warning.to_string(), &warning.message)?;
        }
        self.report_withheld();
        Ok(())
    }

    /// Reports a warning; `message` is the part that decides its kind.
    fn warn_of_kind(&self, text: &str, message: &str) -> Result<()> {
        if self.strict {
            return Err(strict_error(text));
        }
        let mut warnings = self.warnings();
        let mut hasher = DefaultHasher::new();
        text.hash(&mut hasher);
        if !warnings.known.insert(hasher.finish()) {
            return Ok(());
        }
        if self.reporter.prints_all_warnings() || warnings.filter.admit(message) {
            self.reporter.warn(self.scene, text);
        }
        if let Some(collected) = &mut warnings.collected {
            collected.push(text.into());
        }
        Ok(())
    }

    /// Reports how many warnings were withheld since the last call.
    fn report_withheld(&self) {
        for line in self.warnings().filter.summary("use --verbose to print all") {
            self.reporter.warn(self.scene, &line);
        }
    }

    /// Reports the number of withheld warnings, and returns all warnings in their order if they were collected.
    pub fn finish(self) -> Vec<String> {
        self.report_withheld();
        self.warnings.into_inner().unwrap_or_else(|e| e.into_inner()).collected.unwrap_or_default()
    }

    fn warnings(&self) -> MutexGuard<'_, Warnings> {
        self.warnings.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// True if a warning ends the scene.
    pub fn is_strict(&self) -> bool {
        self.strict
    }

    /// Reports a choice, for --verbose.
    pub fn note(&self, text: &str) {
        self.reporter.note(text);
    }

    /// Reports the time of a stage, for --perf.
    pub fn stage(&self, name: &str, since: Instant, detail: &str) {
        self.stage_took(name, since.elapsed(), detail);
    }

    /// Reports the time of a stage that ended earlier, for --perf.
    pub fn stage_took(&self, name: &str, time: Duration, detail: &str) {
        self.reporter.stage(name, time, detail);
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::LogArgs;

    #[derive(Parser)]
    struct Args {
        #[command(flatten)]
        log: LogArgs,
    }

    #[test]
    fn each_warning_is_collected_once_and_in_order() {
        let reporter = Reporter::new(&Args::parse_from(["blinn"]).log, 1, true);
        let log = SceneLog::new(&reporter, Path::new("a.glb"), false).collecting();
        let texts: Vec<String> = (0..1000).map(|i| format!("no texture {}", i * 7919 % 1000)).collect();
        for text in texts.iter().chain(&texts) {
            assert!(log.warn(text).is_ok());
        }
        assert_eq!(log.finish(), texts);
        let log = SceneLog::new(&reporter, Path::new("a.glb"), false);
        assert!(log.warn("no texture").is_ok());
        assert!(log.finish().is_empty(), "nothing is kept where no page needs it");
    }
}
