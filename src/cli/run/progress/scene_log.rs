//! Messages about one scene.

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use anyhow::Result;

use super::reporter::Reporter;
use crate::console::{strict_error, with_flags};
use crate::warning_filter::WarningFilter;
use blinn_import::Warning;
use blinn_session::{Notice, SessionError, SessionLog};

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

    /// Reports a warning unless it was reported before.
    fn report(&self, text: &str) {
        self.report_of_kind(text, text);
    }

    /// Reports the warnings of an import, then how many of each kind were withheld.
    pub fn warn_of_import(&self, warnings: Vec<Warning>) -> Result<()> {
        for warning in warnings {
            if self.strict {
                return Err(strict_error(warning));
            }
            self.report_of_kind(&with_flags(&warning.to_string()), &warning.message);
        }
        self.report_withheld();
        Ok(())
    }

    /// Reports a warning; `message` is the part that decides its kind.
    fn report_of_kind(&self, text: &str, message: &str) {
        let mut warnings = self.warnings();
        let mut hasher = DefaultHasher::new();
        text.hash(&mut hasher);
        if !warnings.known.insert(hasher.finish()) {
            return;
        }
        if self.reporter.prints_all_warnings() || warnings.filter.admit(message) {
            self.reporter.warn(self.scene, text);
        }
        if let Some(collected) = &mut warnings.collected {
            collected.push(text.into());
        }
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

    /// Reports the time since the start of a stage, for --perf.
    pub fn stage_since(&self, stage: &str, start: Instant, detail: &str) {
        self.stage(stage, start.elapsed(), detail);
    }
}

impl SessionLog for SceneLog<'_> {
    /// Reports a warning unless it was reported before. With --strict, returns it as an error.
    fn warn(&self, notice: Notice) -> Result<(), SessionError> {
        if self.strict {
            return Err(SessionError::Warning(notice));
        }
        self.report(&with_flags(&notice.to_string()));
        Ok(())
    }

    fn hint(&self, notice: Notice) {
        self.reporter.hint(self.scene, &notice.to_string());
    }

    /// Reports a choice, for --verbose.
    fn note(&self, notice: Notice) {
        self.reporter.note(&notice.to_string());
    }

    /// Reports the time of a stage, for --perf.
    fn stage(&self, stage: &str, time: Duration, detail: &str) {
        self.reporter.stage(stage, time, detail);
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
            assert!(log.warn(Notice::View(text.clone())).is_ok());
        }
        assert_eq!(log.finish(), texts);
        let log = SceneLog::new(&reporter, Path::new("a.glb"), false);
        assert!(log.warn(Notice::View("no texture".into())).is_ok());
        assert!(log.finish().is_empty(), "nothing is kept where no page needs it");
    }
}
