//! Reports the progress of a benchmark on standard error.

use crate::bench::{BenchObserver, Workload};
use crate::cli::console::{eprint_line, single_line, strict_error};
use crate::import::Warning;

pub struct ConsoleObserver {
    pub quiet: bool,
    pub strict: bool,
    pub rounds: u32,
}

impl BenchObserver for ConsoleObserver {
    fn scene_started(&mut self, workload: &Workload, round: u32) {
        if !self.quiet {
            eprint_line(&format!("round {round} of {}: {}", self.rounds, single_line(&workload.name)));
        }
    }

    fn scene_loaded(&mut self, workload: &Workload, warnings: &[Warning]) -> Result<(), String> {
        for warning in warnings {
            if self.strict {
                return Err(strict_error(warning).to_string());
            }
            if !self.quiet {
                eprint_line(&single_line(&format!("warning: {}: {warning}", workload.name)));
            }
        }
        Ok(())
    }
}
