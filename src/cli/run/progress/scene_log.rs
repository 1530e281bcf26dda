//! Messages about one scene.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

use anyhow::Result;

use super::reporter::Reporter;
use crate::cli::console::strict_error;

/// Reports each warning of a scene once, and collects them.
pub struct SceneLog<'a> {
    pub reporter: &'a Reporter,
    scene: &'a Path,
    strict: bool,
    /// Reported warnings with their order.
    warnings: Mutex<HashMap<String, usize>>,
}

impl<'a> SceneLog<'a> {
    pub fn new(reporter: &'a Reporter, scene: &'a Path, strict: bool) -> SceneLog<'a> {
        SceneLog { reporter, scene, strict, warnings: Mutex::default() }
    }

    /// Reports a warning unless it was reported before. With --strict, returns it as an error.
    pub fn warn(&self, text: &str) -> Result<()> {
        if self.strict {
            return Err(strict_error(text));
        }
        let mut warnings = self.warnings.lock().unwrap_or_else(|e| e.into_inner());
        let order = warnings.len();
        if let Entry::Vacant(entry) = warnings.entry(text.into()) {
            entry.insert(order);
            self.reporter.warn(self.scene, text);
        }
        Ok(())
    }

    /// All warnings in the order of their reports.
    pub fn warnings(self) -> Vec<String> {
        let mut warnings = Vec::from_iter(self.warnings.into_inner().unwrap_or_else(|e| e.into_inner()));
        warnings.sort_unstable_by_key(|(_, order)| *order);
        warnings.into_iter().map(|(text, _)| text).collect()
    }

    /// Reports a choice, for --verbose.
    pub fn note(&self, text: &str) {
        self.reporter.note(text);
    }

    /// Reports the time of a stage, for --perf.
    pub fn stage(&self, name: &str, since: Instant, detail: &str) {
        self.reporter.stage(name, since, detail);
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::args::LogArgs;

    #[derive(Parser)]
    struct Args {
        #[command(flatten)]
        log: LogArgs,
    }

    #[test]
    fn each_warning_is_reported_once_and_in_order() {
        let reporter = Reporter::new(&Args::parse_from(["blinn"]).log, 1, true);
        let log = SceneLog::new(&reporter, Path::new("a.glb"), false);
        let texts: Vec<String> = (0..1000).map(|i| format!("no texture {}", i * 7919 % 1000)).collect();
        for text in texts.iter().chain(&texts) {
            assert!(log.warn(text).is_ok());
        }
        assert_eq!(log.warnings(), texts);
    }
}
