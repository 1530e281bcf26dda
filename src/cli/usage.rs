//! Errors of the command line, which end the program before it does anything.

use std::ffi::OsString;

use super::console::{eprint_line, print_error, single_line};
use blinn_session::{SessionError, without_error_codes};

/// Exit code of a wrong command line.
pub const EXIT_USAGE: u8 = 2;

/// A wrong command line: the flag or value, what is wrong with it, and what to do.
#[derive(Debug)]
pub struct UsageError(pub String);

impl From<SessionError> for UsageError {
    fn from(error: SessionError) -> UsageError {
        UsageError(without_error_codes(&error.to_string()))
    }
}

impl UsageError {
    /// Reports the error and returns the exit code. `argv` tells whether an OpenJD engine listens.
    pub fn exit(self, argv: &[OsString]) -> u8 {
        if wants_openjd_messages(argv) {
            eprint_line(&format!("openjd_fail: {}", single_line(&self.0)));
        }
        print_error(&self.0);
        EXIT_USAGE
    }
}

/// True if arguments, which may not parse, contain `--progress openjd`.
fn wants_openjd_messages(argv: &[OsString]) -> bool {
    argv.iter().any(|arg| arg == "--progress=openjd")
        || argv.windows(2).any(|pair| pair[0] == "--progress" && pair[1] == "openjd")
}
