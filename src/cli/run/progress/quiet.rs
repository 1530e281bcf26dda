//! A reporter that prints nothing.

use clap::Parser;

use super::reporter::Reporter;
use crate::args::LogArgs;

/// Returns a reporter that prints nothing.
pub fn quiet_reporter() -> Reporter {
    #[derive(Parser)]
    struct Log {
        #[command(flatten)]
        log: LogArgs,
    }
    Reporter::new(&Log::parse_from([""]).log, 1, true)
}
