//! The flags that a command line sets explicitly.

use std::ffi::{OsStr, OsString};

use clap::ArgAction;
use clap::parser::ValueSource;

use crate::cli::args::command_tree::{built, find_command, innermost};
use crate::cli::args::help;
use crate::cli::usage::UsageError;

/// A flag by its own name, also if an alias was used.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Flag {
    /// Without dashes.
    name: String,
    value: Option<String>,
}

/// The flags after `render` or `turntable`.
#[derive(Debug)]
pub struct ExplicitFlags(Vec<Flag>);

impl ExplicitFlags {
    /// Reads a valid command line.
    ///
    /// # Errors
    /// A value that cannot be written in a job.
    pub fn parse(argv: &[OsString]) -> Result<ExplicitFlags, UsageError> {
        let matches = help::full().try_get_matches_from(argv);
        let Some(command) = matches.as_ref().ok().and_then(innermost) else {
            return Ok(ExplicitFlags(Vec::new()));
        };
        let root = built();
        let arguments = find_command(&root, &command.path).into_iter().flat_map(|c| c.get_arguments());
        let mut flags = Vec::new();
        for arg in arguments {
            let id = arg.get_id().as_str();
            let Some(name) = arg.get_long() else { continue };
            if command.matches.value_source(id) != Some(ValueSource::CommandLine) {
                continue;
            }
            let flag = |value| Flag { name: name.into(), value };
            let values = command.matches.try_get_raw(id).ok().flatten();
            match values.filter(|_| !matches!(arg.get_action(), ArgAction::SetTrue)) {
                None => flags.push(flag(None)),
                Some(values) => {
                    for value in values {
                        flags.push(flag(Some(single_line_text(&format!("--{name}"), value)?)));
                    }
                }
            }
        }
        Ok(ExplicitFlags(flags))
    }

    pub fn contains(&self, name: &str) -> bool {
        self.0.iter().any(|flag| flag.name == name)
    }

    /// Removes flags.
    pub fn without(self, names: &[&str]) -> ExplicitFlags {
        ExplicitFlags(self.0.into_iter().filter(|flag| !names.contains(&flag.name.as_str())).collect())
    }

    /// The flags as arguments: `--name=value`.
    pub fn to_args(&self) -> Vec<String> {
        let arg = |Flag { name, value }: &Flag| match value {
            Some(value) => format!("--{name}={value}"),
            None => format!("--{name}"),
        };
        self.0.iter().map(arg).collect()
    }
}

/// Text that can be written on one line of a job, whatever its language. `what` names it in the error.
///
/// # Errors
/// Text that is not UTF-8 or contains control characters.
pub fn single_line_text(what: &str, value: &OsStr) -> Result<String, UsageError> {
    match value.to_str() {
        Some(text) if !text.contains(char::is_control) => Ok(text.into()),
        _ => Err(UsageError(format!(
            "{what} {}: a job cannot contain line breaks, control characters or text that is not UTF-8; rename it",
            value.to_string_lossy()
        ))),
    }
}
