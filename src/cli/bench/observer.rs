//! Reports the progress of a benchmark on standard error.

use crate::console::{eprint_line, print_warning, single_line, strict_error};
use crate::run::signals::HeldInterrupt;
use crate::warning_filter::WarningFilter;
use blinn_bench::{BenchObserver, Workload};
use blinn_import::Warning;
use blinn_session::without_error_codes;

pub struct ConsoleObserver<'i> {
    pub interrupt: &'i HeldInterrupt,
    pub quiet: bool,
    pub strict: bool,
    pub rounds: u32,
}

impl BenchObserver for ConsoleObserver<'_> {
    fn scene_started(&mut self, workload: &Workload, round: u32) {
        if !self.quiet {
            eprint_line(&format!("round {round} of {}: {}", self.rounds, single_line(&workload.name)));
        }
    }

    fn scene_loaded(&mut self, workload: &Workload, warnings: &[Warning]) -> Result<(), String> {
        if let Some(warning) = warnings.first().filter(|_| self.strict) {
            return Err(strict_error(warning).to_string());
        }
        let mut filter = WarningFilter::default();
        let admitted = warnings.iter().filter(|warning| filter.admit(&warning.message));
        let mut lines: Vec<String> =
            admitted.map(|warning| without_error_codes(&warning.to_string())).collect();
        lines.extend(filter.summary("use blinn info --json to print all"));
        for line in lines.iter().filter(|_| !self.quiet) {
            print_warning(&format!("{}: {line}", workload.name));
        }
        Ok(())
    }

    fn is_stopped(&self) -> bool {
        self.interrupt.is_interrupted()
    }
}
