//! Telling of one scene.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

use crate::cli::run::progress::Reporter;

/// Tells of one scene.
pub(crate) struct Teller<'a> {
    pub reporter: &'a Reporter,
    scene: &'a Path,
    strict: bool,
    /// What it warned of, once for all frames, and how many warnings came before.
    warned: Mutex<HashMap<String, usize>>,
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
        let before = warned.len();
        if let Entry::Vacant(new) = warned.entry(text.into()) {
            new.insert(before);
            self.reporter.warn(self.scene, text);
        }
        Ok(())
    }

    /// All that it warned of, in that order.
    pub fn warnings(self) -> Vec<String> {
        let mut warned = Vec::from_iter(self.warned.into_inner().unwrap_or_else(|e| e.into_inner()));
        warned.sort_unstable_by_key(|(_, before)| *before);
        warned.into_iter().map(|(text, _)| text).collect()
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

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::cli::args::TellArgs;

    #[derive(Parser)]
    struct Args {
        #[command(flatten)]
        telling: TellArgs,
    }

    #[test]
    fn each_warning_is_told_once_in_the_order_they_came() {
        let reporter = Reporter::new(&Args::parse_from(["blinn"]).telling, 1, true);
        let teller = Teller::new(&reporter, Path::new("a.glb"), false);
        let texts: Vec<String> = (0..1000).map(|i| format!("no texture {}", i * 7919 % 1000)).collect();
        for text in texts.iter().chain(&texts) {
            assert!(teller.warn(text).is_ok());
        }
        assert_eq!(teller.warnings(), texts);
    }
}
