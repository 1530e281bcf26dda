//! The flags of a command line, as they were given.

use std::ffi::OsString;

use clap::ArgAction;
use clap::parser::ValueSource;

use crate::cli::Usage;
use crate::cli::args::config::{built, command_at, deepest};
use crate::cli::args::help;

/// A flag of the command that renders, by its own name even where an alias was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Flag {
    /// Without dashes.
    pub name: String,
    /// `None` for a flag alone.
    pub value: Option<String>,
}

/// All that stands behind `render` or `turntable`, but for the scene.
#[derive(Debug)]
pub struct Given(Vec<Flag>);

impl Given {
    /// Reads a command line that makes sense.
    ///
    /// # Errors
    /// Values that no text of a job can hold.
    pub fn of(words: &[OsString]) -> Result<Given, Usage> {
        let matches = help::full().try_get_matches_from(words);
        let Some((names, given)) = matches.as_ref().ok().and_then(deepest) else {
            return Ok(Given(Vec::new()));
        };
        let cli = built();
        let mut flags = Vec::new();
        for arg in command_at(&cli, &names).into_iter().flat_map(|command| command.get_arguments()) {
            let id = arg.get_id().as_str();
            let Some(name) = arg.get_long() else { continue };
            if given.value_source(id) != Some(ValueSource::CommandLine) {
                continue;
            }
            let flag = |value| Flag { name: name.into(), value };
            let values = given.try_get_raw(id).ok().flatten().filter(|_| arg.get_action().takes_values());
            match (arg.get_action(), values) {
                (ArgAction::SetTrue, _) | (_, None) => flags.push(flag(None)),
                (_, Some(values)) => {
                    for value in values {
                        flags.push(flag(Some(text(&format!("--{name}"), value)?)));
                    }
                }
            }
        }
        Ok(Given(flags))
    }

    /// Whether a flag was given.
    pub fn has(&self, name: &str) -> bool {
        self.0.iter().any(|flag| flag.name == name)
    }

    /// Takes flags away.
    pub fn without(self, names: &[&str]) -> Given {
        Given(self.0.into_iter().filter(|flag| !names.contains(&flag.name.as_str())).collect())
    }

    /// As words.
    pub fn words(&self) -> Vec<String> {
        let word = |Flag { name, value }: &Flag| match value {
            Some(value) => format!("--{name}={value}"),
            None => format!("--{name}"),
        };
        self.0.iter().map(word).collect()
    }
}

/// What can stand in one line of a job, whatever its language.
///
/// # Errors
/// Text that is not UTF-8, or that has line breaks or other control characters.
pub fn text(what: &str, value: &std::ffi::OsStr) -> Result<String, Usage> {
    match value.to_str() {
        Some(text) if !text.contains(char::is_control) => Ok(text.into()),
        _ => Err(Usage(format!(
            "{what} {}: a job is lines of UTF-8 text: call it without line breaks and control characters",
            value.to_string_lossy()
        ))),
    }
}
