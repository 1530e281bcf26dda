//! Merges the options of a `--config` file into the arguments.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Arg, ArgAction, ArgMatches, Command};
use toml::{Table, Value};

use super::{explicit_args, has_conflict, key};
use crate::args::command_tree::{built, find_command, innermost};
use crate::args::help;
use crate::usage::UsageError;
use blinn_core::worded;

/// Inserts the options of the `--config` file that `argv` names. Options that `argv` sets itself, and those that
/// conflict with them, are left out.
pub fn merge_file(mut argv: Vec<OsString>) -> Result<Vec<OsString>, UsageError> {
    if !may_name_file(&argv) {
        return Ok(argv);
    }
    // Required arguments may come from the file, so errors are ignored here.
    let lenient = help::full().ignore_errors(true);
    let matches = lenient.clone().try_get_matches_from(&argv);
    let Some(command) = matches.as_ref().ok().and_then(innermost) else { return Ok(argv) };
    let Ok(Some(file)) = command.matches.try_get_one::<PathBuf>("config") else { return Ok(argv) };
    let error = |text: String| UsageError(worded!("`config` {}: {}", file.display(), text));
    let text = std::fs::read_to_string(file).map_err(|e| error(e.to_string()))?;
    let table = parse(&text).map_err(error)?;
    let root = built();
    let Some(definition) = find_command(&root, &command.path) else { return Ok(argv) };
    let from_file = to_args(definition, command.matches, &table).map_err(error)?;
    // They go directly after the command's name. The first word that reads like it may be a value, so find the
    // shortest prefix of `argv` that selects the command.
    let selects_command = |count: &usize| {
        let prefix = lenient.clone().try_get_matches_from(&argv[..*count]);
        prefix.as_ref().ok().and_then(innermost).is_some_and(|found| found.path == command.path)
    };
    let at = (1..=argv.len()).find(selects_command).unwrap_or(argv.len());
    argv.splice(at..at, from_file);
    Ok(argv)
}

/// The `--config` file that a command line names.
pub fn file_name(argv: &[OsString]) -> Option<PathBuf> {
    if !may_name_file(argv) {
        return None;
    }
    let matches = help::full().ignore_errors(true).try_get_matches_from(argv).ok()?;
    innermost(&matches)?.matches.try_get_one::<PathBuf>("config").ok().flatten().cloned()
}

/// False if no argument begins like `--config`. Building the commands to find out takes as long as to read a small scene.
fn may_name_file(argv: &[OsString]) -> bool {
    argv.iter().any(|arg| arg.as_encoded_bytes().starts_with(b"--config"))
}

fn parse(text: &str) -> Result<Table, String> {
    text.parse().map_err(|e: toml::de::Error| {
        let line = e.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
        format!("line {line}: {}", e.message())
    })
}

/// Arguments for the options of a file.
fn to_args(command: &Command, matches: &ArgMatches, table: &Table) -> Result<Vec<OsString>, String> {
    let explicit = explicit_args(command, matches);
    let mut args = Vec::new();
    for (name, value) in table {
        let Some(arg) = command.get_arguments().find(|arg| key(arg) == Some(name)) else {
            return Err(format!("'{name}' is not an option of {}", command.get_name()));
        };
        if explicit.contains(&arg.get_id()) || has_conflict(command, arg, &explicit) {
            continue;
        }
        let values = values_of(arg, value)
            .ok_or_else(|| format!("'{name}' cannot be {value}; expected {}", expected_value(arg)))?;
        for text in values {
            args.push(match text {
                // Among options, text that begins with a dash would be one.
                Some(text) if arg.is_positional() && text.starts_with('-') => format!("./{text}").into(),
                Some(text) if arg.is_positional() => text.into(),
                Some(text) => format!("--{name}={text}").into(),
                None => format!("--{name}").into(),
            });
        }
    }
    Ok(args)
}

/// The values of an option, one for each time it appears in the arguments; `None` for the option without a value.
fn values_of(arg: &Arg, value: &Value) -> Option<Vec<Option<String>>> {
    let takes_values = arg.get_action().takes_values();
    let value_is_optional = !takes_values || arg.get_num_args().is_some_and(|n| n.min_values() == 0);
    let is_repeatable = matches!(arg.get_action(), ArgAction::Append);
    match value {
        Value::Boolean(true) if value_is_optional => Some(vec![None]),
        Value::Boolean(false) if value_is_optional => Some(Vec::new()),
        _ if !takes_values => None,
        // A list of numbers is one value; an empty list is none.
        Value::Array(list) if is_repeatable && (list.is_empty() || !list.iter().all(is_number)) => {
            list.iter().map(|item| text_of(item).map(Some)).collect()
        }
        value => Some(vec![Some(text_of(value)?)]),
    }
}

/// Says what an option can be set to.
fn expected_value(arg: &Arg) -> &'static str {
    match arg.get_action().takes_values() {
        true => "a number or a text in quotes",
        false => "true or false",
    }
}

/// A value as it is written on the command line.
pub(super) fn text_of(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => Some(text.clone()),
        Value::Integer(n) => Some(n.to_string()),
        Value::Float(x) => Some(x.to_string()),
        Value::Array(list) => Some(list.iter().map(text_of).collect::<Option<Vec<_>>>()?.join(",")),
        _ => None,
    }
}

fn is_number(value: &Value) -> bool {
    value.is_integer() || value.is_float()
}
