//! Standard error and standard output: the one is told what happens, the other gets what was asked for.

use std::io::{self, ErrorKind, Write, stderr, stdout};
use std::path::Path;

use anyhow::{Context, Result};

/// Whether a file's name stands for standard output.
pub(super) fn is_stdout(name: &Path) -> bool {
    name == Path::new("-")
}

/// Tells a line on standard error. Where it cannot be told, work goes on.
pub(super) fn tell(line: &str) {
    let _ = writeln!(stderr().lock(), "{line}");
}

/// Prints all of what was asked for.
pub(super) fn print(bytes: &[u8]) -> Result<()> {
    let written = stdout().lock().write_all(bytes);
    printed(written)
}

/// What came of printing, once nothing is held back any more. A closed pipe is no error: whoever reads
/// it has seen enough.
pub(super) fn printed(written: io::Result<()>) -> Result<()> {
    match written.and_then(|()| stdout().lock().flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other.context("standard output cannot be written"),
    }
}
