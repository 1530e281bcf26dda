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
    /// Number of scenes that were not started, or given up before they ended.
    pub not_started: usize,
    /// Number of scenes that were rendered for an archive that was not written.
    pub not_written: usize,
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

    /// Counts as not started what is left of `all` scenes.
    pub fn count_not_started(&mut self, all: usize) {
        self.not_started = all.saturating_sub(self.scenes + self.skipped_done + self.skipped_failed);
    }

    /// Number of scenes whose images were not made, for no reason of their own.
    pub fn left(&self) -> usize {
        self.not_started + self.not_written
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
        if total > 1
            && let Some(line) = self.incomplete_line(total)
        {
            print_error(&line);
            self.failures.iter().for_each(|line| print_error_detail(line));
            if self.failed > self.failures.len() {
                print_error_detail(&format!("and {} more", self.failed - self.failures.len()));
            }
        }
        self.exit_code()
    }

    /// Counts scenes without images by the reason; `None` if there are none.
    fn incomplete_line(&self, total: usize) -> Option<String> {
        let counts =
            [(self.failed, "failed"), (self.not_written, "not written"), (self.not_started, "not started")];
        let mut parts = counts.into_iter().filter(|&(count, _)| count > 0);
        let (count, what) = parts.next()?;
        let mut line = format!("{count} of {total} scenes {what}");
        parts.for_each(|(count, what)| line += &format!(", {count} {what}"));
        if self.failed > 0 {
            line.push(':');
        }
        Some(line)
    }

    pub fn exit_code(&self) -> u8 {
        let is_complete = self.failed == 0 && self.skipped_failed == 0 && !self.other_failure;
        if is_complete && !self.is_different { EXIT_SUCCESS } else { EXIT_FAILURE }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_without_images_are_counted_by_reason() {
        let line = |failed, not_written, not_started| {
            let summary = Summary { failed, not_written, not_started, ..Summary::default() };
            summary.incomplete_line(9)
        };
        assert_eq!(line(0, 0, 0), None);
        assert_eq!(line(2, 0, 0).as_deref(), Some("2 of 9 scenes failed:"));
        assert_eq!(line(0, 0, 4).as_deref(), Some("4 of 9 scenes not started"));
        assert_eq!(line(1, 0, 4).as_deref(), Some("1 of 9 scenes failed, 4 not started:"));
        assert_eq!(line(0, 3, 4).as_deref(), Some("3 of 9 scenes not written, 4 not started"));
        let mut summary = Summary { scenes: 3, skipped_done: 2, skipped_failed: 1, ..Summary::default() };
        summary.count_not_started(9);
        assert_eq!((summary.not_started, summary.left()), (3, 3));
    }
}
