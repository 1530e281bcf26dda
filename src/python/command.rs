//! The command `blinn` of the Python package.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the command line program and returns its exit code.
///
/// It handles signals like the program. Call it in a process of its own: it ends the process when it is interrupted.
#[pyfunction]
pub fn main(py: Python<'_>, argv: Vec<OsString>) -> u8 {
    py.detach(|| blinn_cli::embed::run_program(argv))
}
