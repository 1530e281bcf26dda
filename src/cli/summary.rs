//! Outcome of a command: which scenes failed, and the exit code that follows.

use anyhow::Result;

use super::console::{print_error, print_error_detail};

/// Exit code if everything succeeded.
pub const EXIT_SUCCESS: u8 = 0;
/// Exit code if something failed. The rest was done.
pub const EXIT_FAILURE: u8 = 1;

/// Number of failures that are listed again at the end.
const LISTED: usize = 100;

/// Outcomes of all scenes of a command.
#[derive(Debug, Default)]
pub struct Summary {
    /// Number of scenes that were started.
    pub scenes: usize,
    /// Number of scenes that were not started.
    pub not_started: usize,
    /// Number of scenes that failed.
    pub failed: usize,
    /// Error lines of the first scenes that failed.
    pub(super) failures: Vec<String>,
    /// Number of scenes that were skipped because a ledger names them as done, or an archive has their images.
    pub skipped_done: usize,
    /// Number of scenes that were skipped because a ledger names them as failed.
    pub skipped_failed: usize,
    /// True if something failed that belongs to no scene. It has been reported.
    pub other_failure: bool,
    /// True if a comparison found differences.
    pub is_different: bool,
}

impl Summary {
    /// Summary of a command that only writes output.
    pub fn of_output(written: Result<()>) -> Summary {
        let mut summary = Summary::default();
        summary.record(written);
        summary
    }

    /// Adds the outcome of a scene: its error line, which has been reported, or `None` for success.
    pub fn add_scene(&mut self, failure: Option<String>) {
        self.scenes += 1;
        if let Some(line) = failure {
            self.add_failure(line);
        }
    }

    /// Adds an error line, which has been reported.
    pub fn add_failure(&mut self, line: String) {
        self.failed += 1;
        if self.failures.len() < LISTED {
            self.failures.push(line);
        }
    }

    /// Records and reports an outcome that belongs to no scene.
    pub fn record(&mut self, outcome: Result<()>) {
        if let Err(error) = outcome {
            self.other_failure = true;
            print_error(&format!("{error:#}"));
        }
    }

    /// Lists the failures of several scenes again, since the first reports may have scrolled away, and returns the
    /// exit code.
    pub fn exit(self) -> u8 {
        let total = self.scenes + self.not_started;
        if total > 1 && self.failed > 0 {
            let not_started = match self.not_started {
                0 => String::new(),
                count => format!(", {count} not started"),
            };
            print_error(&format!("{} of {total} scenes failed{not_started}:", self.failed));
            self.failures.iter().for_each(|line| print_error_detail(line));
            if self.failed > self.failures.len() {
                print_error_detail(&format!("and {} more", self.failed - self.failures.len()));
            }
        }
        self.exit_code()
    }

    pub fn exit_code(&self) -> u8 {
        let is_complete = self.failed == 0 && self.skipped_failed == 0 && !self.other_failure;
        if is_complete && !self.is_different { EXIT_SUCCESS } else { EXIT_FAILURE }
    }
}
