//! The command `blinn` of the Python package.

use std::ffi::OsString;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use super::log::keyword;
use super::options::unknown_option;
use blinn_cli::embed::{flag, has_flag, run_program, shown_flags};

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

/// The command that `write_dataset` runs.
const DATASET_COMMAND: &str = "turntable";
/// Its options that are parameters of `write_dataset`, and these parameters, which have other names.
const REPLACED: [(&str, &str); 3] =
    [("dataset", "formats"), ("output", "folder and name"), ("aov", "layers")];
/// Other parameters of `write_dataset`.
const PARAMETERS: [&str; 4] = ["scenes", "folder", "formats", "layers"];
/// Options that `write_dataset` sets itself.
const RESERVED: [&str; 2] = ["print-paths", "progress"];

/// Check that keyword arguments of `write_dataset` are options of the command.
#[pyfunction]
pub fn check_dataset_options(keywords: Vec<String>) -> PyResult<()> {
    let name = |key: &str| key.trim_end_matches('_').replace('_', "-");
    let is_unknown = |key: &&String| {
        let name = name(key);
        RESERVED.contains(&&*name)
            || REPLACED.iter().any(|(option, _)| *option == name)
            || !has_flag(DATASET_COMMAND, &name)
    };
    let Some(key) = keywords.iter().find(is_unknown) else { return Ok(()) };
    if let Some((option, instead)) = REPLACED.iter().find(|(option, _)| *option == name(key)) {
        return Err(PyTypeError::new_err(format!("{option} is no option of write_dataset; use {instead}")));
    }
    Err(unknown_option(key, &dataset_keywords(), &PARAMETERS))
}

/// The keyword arguments that set options of the command, sorted.
fn dataset_keywords() -> Vec<String> {
    let mut names = shown_flags(DATASET_COMMAND);
    names.retain(|name| !RESERVED.contains(&&**name) && REPLACED.iter().all(|(option, _)| option != name));
    names.iter_mut().for_each(|name| *name = name.replace('-', "_"));
    names.sort();
    names
}
