//! Telling of one scene.

use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

use super::Reporter;

/// Tells of one scene.
pub(in crate::cli) struct Teller<'a> {
    pub reporter: &'a Reporter,
    scene: &'a Path,
    strict: bool,
    /// What it warned of: once for all frames.
    warned: Mutex<Vec<String>>,
}

impl<'a> Teller<'a> {
    pub fn new(reporter: &'a Reporter, scene: &'a Path, strict: bool) -> Teller<'a> {
        Teller { reporter, scene, strict, warned: Mutex::default() }
    }

    /// Passes a warning on, or fails on it with `--strict`.
    pub fn warn(&self, text: &str) -> anyhow::Result<()> {
        if self.strict {
            anyhow::bail!("{text} (an error because of --strict)");
        }
        let mut warned = self.warned.lock().unwrap_or_else(|e| e.into_inner());
        if !warned.iter().any(|known| known == text) {
            warned.push(text.into());
            self.reporter.warn(self.scene, text);
        }
        Ok(())
    }

    /// All that it warned of.
    pub fn warnings(self) -> Vec<String> {
        self.warned.into_inner().unwrap_or_else(|e| e.into_inner())
    }

    /// Something that was chosen.
    pub fn note(&self, text: &str) {
        self.reporter.note(text);
    }

    /// A stage's time, for `--perf`.
    pub fn stage(&self, name: &str, since: Instant, what: &str) {
        self.reporter.stage(name, since, what);
    }
}
