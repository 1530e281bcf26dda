//! The command `blinn` of the Python package.

use std::ffi::OsString;

use pyo3::prelude::*;

use super::log::keyword;
use blinn_cli::embed::{flag, run_program};

/// Runs the command line program and returns its exit code.
///
/// It handles signals like the program. Call it in a process of its own: it ends the process when it is interrupted.
/// With `keywords`, messages name options as arguments of functions.
#[pyfunction]
#[pyo3(signature = (argv, *, keywords = false))]
pub fn main(py: Python<'_>, argv: Vec<OsString>, keywords: bool) -> u8 {
    let word = if keywords { keyword } else { flag };
    py.detach(|| run_program(argv, word))
}
