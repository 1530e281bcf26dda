//! `--print-config`: all options of a command line as a `--config` file.

use std::ffi::OsString;

use clap::{Arg, ArgAction, ArgMatches};
use toml::{Table, Value};

use super::read::text_of;
use super::{explicit_args, has_conflict, key};
use crate::args::command_tree::{built, find_command, innermost};
use crate::args::help;
use crate::usage::UsageError;
use blinn_core::worded;

/// The options of a command line with their defaults as TOML. Defaults that conflict with explicit options are left
/// out.
///
/// # Errors
/// A value that is not UTF-8.
pub fn print(argv: &[OsString]) -> Result<String, UsageError> {
    let matches = help::full().try_get_matches_from(argv);
    let Some(command) = matches.as_ref().ok().and_then(innermost) else { return Ok(String::new()) };
    let root = built();
    let Some(definition) = find_command(&root, &command.path) else { return Ok(String::new()) };
    let explicit = explicit_args(definition, command.matches);
    let mut table = Table::new();
    for arg in definition.get_arguments().filter(|arg| !has_conflict(definition, arg, &explicit)) {
        if let Some(key) = key(arg)
            && let Some(value) = value_of(arg, command.matches)?
        {
            table.insert(key.into(), value);
        }
    }
    Ok(toml::to_string(&table).unwrap_or_default())
}

/// The value of an option, explicit or by default.
fn value_of(arg: &Arg, matches: &ArgMatches) -> Result<Option<Value>, UsageError> {
    let id = arg.get_id().as_str();
    if matches!(arg.get_action(), ArgAction::SetTrue) {
        return Ok(Some(Value::Boolean(matches.get_flag(id))));
    }
    if matches.value_source(id).is_none() {
        return Ok(None);
    }
    let mut texts = Vec::new();
    for raw in matches.try_get_raw(id).ok().flatten().into_iter().flatten() {
        let text = raw.to_str().ok_or_else(|| {
            let name = key(arg).unwrap_or(id);
            UsageError(worded!("`print-config`: {} {} is not UTF-8, as TOML has to be", name, raw.display()))
        })?;
        texts.push(text);
    }
    Ok(Some(match (arg.get_action(), &texts[..]) {
        // As numbers they would be read as one value.
        (ArgAction::Append, _) => Value::Array(texts.into_iter().map(Value::from).collect()),
        (_, []) => Value::Boolean(true),
        (_, [first, ..]) => typed(first),
    }))
}

/// A number if it is written in TOML exactly as in `text`, else a string.
fn typed(text: &str) -> Value {
    let integer = text.parse().map(Value::Integer).ok();
    let float = || text.parse().map(Value::Float).ok();
    let number = integer.or_else(float).filter(|number| text_of(number).as_deref() == Some(text));
    number.unwrap_or_else(|| text.into())
}
