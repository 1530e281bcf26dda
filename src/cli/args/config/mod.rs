//! Options in a file: `--config FILE.toml` has options by their long names, and the command line overrides them.
//!
//! A file is turned into arguments that are parsed like any others.

mod print;
mod read;
#[cfg(test)]
mod tests;

use clap::parser::ValueSource;
use clap::{Arg, ArgMatches, Command, Id};

pub use print::print;
pub use read::{file_name, merge_file};

/// Options that a file cannot set.
const NOT_SETTINGS: [&str; 4] = ["config", "print-config", "help", "help-short"];

/// The key of an argument in a file; `None` for arguments that a file cannot set.
fn key(arg: &Arg) -> Option<&str> {
    let name = arg.get_long().or_else(|| arg.is_positional().then(|| arg.get_id().as_str()));
    name.filter(|name| !NOT_SETTINGS.contains(name))
}

/// Arguments that the command line itself sets.
fn explicit_args<'c>(command: &'c Command, matches: &ArgMatches) -> Vec<&'c Id> {
    let is_explicit = |id: &&Id| matches.value_source(id.as_str()) == Some(ValueSource::CommandLine);
    command.get_arguments().map(Arg::get_id).filter(is_explicit).collect()
}

/// True if an argument conflicts with one of the explicit arguments.
fn has_conflict(command: &Command, arg: &Arg, explicit: &[&Id]) -> bool {
    let excludes = |one: &Arg, other: &Id| {
        command.get_arg_conflicts_with(one).iter().any(|conflict| conflict.get_id() == other)
    };
    let mut others = command.get_arguments().filter(|other| explicit.contains(&other.get_id()));
    others.any(|other| excludes(other, arg.get_id()) || excludes(arg, other.get_id()))
}
