//! Settings from a file: `--config FILE.toml` has flags by their names, and the command line wins.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command};
use toml::{Table, Value};

use super::{Usage, help};

/// Flags that no file sets.
const NOT_SETTINGS: [&str; 4] = ["config", "print-config", "help", "help-all"];

/// The words of a command line, with those of its `--config` file put in where it says nothing
/// itself.
pub(super) fn with_file(mut words: Vec<OsString>) -> Result<Vec<OsString>, Usage> {
    // What is still missing may be in the file, so this look does not mind.
    let lenient = help::full().ignore_errors(true).try_get_matches_from(&words);
    let Some((path_of, given)) = lenient.as_ref().ok().and_then(deepest) else { return Ok(words) };
    let Ok(Some(path)) = given.try_get_one::<PathBuf>("config") else { return Ok(words) };
    let wrong = |what: String| Usage(format!("--config {}: {what}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|e| wrong(e.to_string()))?;
    let table: Table = text.parse().map_err(|e: toml::de::Error| {
        let line = e.span().map_or(1, |at| 1 + text[..at.start.min(text.len())].matches('\n').count());
        wrong(format!("line {line}: {}", e.message()))
    })?;
    let cli = built();
    let Some(command) = command_at(&cli, &path_of) else { return Ok(words) };
    let from_file = in_words(command, given, &table).map_err(wrong)?;
    // Directly behind the command's name.
    let behind = |from: usize, name: &&str| {
        words[from..].iter().position(|w| w == name).map_or(words.len(), |i| from + i + 1)
    };
    let place = path_of.iter().fold(1.min(words.len()), behind);
    words.splice(place..place, from_file);
    Ok(words)
}

/// The names of the commands in a command line, such as `job`, `slurm` and `render`, and what was given to
/// the last of them.
pub(super) fn deepest(matches: &ArgMatches) -> Option<(Vec<&str>, &ArgMatches)> {
    let (mut names, mut given) = (Vec::new(), matches);
    while let Some((name, below)) = given.subcommand() {
        names.push(name);
        given = below;
    }
    (!names.is_empty()).then_some((names, given))
}

/// The program's words, with those that clap adds.
pub(super) fn built() -> Command {
    let mut cli = help::full();
    cli.build();
    cli
}

/// The command that is called so.
pub(super) fn command_at<'c>(cli: &'c Command, names: &[&str]) -> Option<&'c Command> {
    names.iter().try_fold(cli, |command, name| command.find_subcommand(name))
}

/// What `table` says and the command line does not, nor anything that excludes it.
fn in_words(command: &Command, given: &ArgMatches, table: &Table) -> Result<Vec<OsString>, String> {
    let is_given = |arg: &Arg| given.value_source(arg.get_id().as_str()) == Some(ValueSource::CommandLine);
    let all_given: Vec<&Arg> = command.get_arguments().filter(|arg| is_given(arg)).collect();
    let mut words = Vec::new();
    for (key, value) in table {
        let named = |arg: &&Arg| name(arg) == Some(key.as_str()) && !NOT_SETTINGS.contains(&key.as_str());
        let Some(arg) = command.get_arguments().find(named) else {
            return Err(format!("'{key}' is no setting of {}", command.get_name()));
        };
        let excludes = |one: &Arg, other: &Arg| {
            command.get_arg_conflicts_with(one).iter().any(|c| c.get_id() == other.get_id())
        };
        if is_given(arg) || all_given.iter().any(|g| excludes(g, arg) || excludes(arg, g)) {
            continue;
        }
        let values = texts(arg, value).ok_or_else(|| format!("'{key}' cannot be {value}"))?;
        for text in values {
            words.push(match text {
                _ if arg.is_positional() => text.unwrap_or_default().into(),
                Some(text) => format!("--{key}={text}").into(),
                None => format!("--{key}").into(),
            });
        }
    }
    Ok(words)
}

/// What a setting is called in a file.
fn name(arg: &Arg) -> Option<&str> {
    arg.get_long().or_else(|| arg.is_positional().then(|| arg.get_id().as_str()))
}

/// The values of a flag, one for each time that it stands in the command line; `None` for a flag
/// alone.
fn texts(arg: &Arg, value: &Value) -> Option<Vec<Option<String>>> {
    let may_stand_alone =
        !arg.get_action().takes_values() || arg.get_num_args().is_some_and(|n| n.min_values() == 0);
    let repeats = matches!(arg.get_action(), ArgAction::Append);
    match value {
        Value::Boolean(true) if may_stand_alone => Some(vec![None]),
        Value::Boolean(false) if may_stand_alone => Some(Vec::new()),
        _ if !arg.get_action().takes_values() => None,
        Value::Array(list) if repeats && !list.iter().all(Value::is_number) => {
            list.iter().map(|one| text(one).map(Some)).collect()
        }
        one => Some(vec![Some(text(one)?)]),
    }
}

fn text(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => Some(text.clone()),
        Value::Integer(n) => Some(n.to_string()),
        Value::Float(x) => Some(x.to_string()),
        Value::Array(list) => Some(list.iter().map(text).collect::<Option<Vec<_>>>()?.join(",")),
        _ => None,
    }
}

trait IsNumber {
    fn is_number(&self) -> bool;
}

impl IsNumber for Value {
    fn is_number(&self) -> bool {
        self.is_integer() || self.is_float()
    }
}

/// All settings of a command line with their defaults, as a file that `--config` takes.
pub(super) fn print(words: &[OsString]) -> String {
    let matches = help::full().try_get_matches_from(words);
    let Some((names, given)) = matches.as_ref().ok().and_then(deepest) else {
        return String::new();
    };
    let cli = built();
    let mut table = Table::new();
    for arg in command_at(&cli, &names).into_iter().flat_map(Command::get_arguments) {
        let id = arg.get_id().as_str();
        let Some(key) = name(arg).filter(|key| !NOT_SETTINGS.contains(key)) else {
            continue;
        };
        let raw = given.try_get_raw(id).ok().flatten();
        let values: Vec<Value> = raw.into_iter().flatten().map(|raw| typed(&raw.to_string_lossy())).collect();
        let value = match (arg.get_action(), given.value_source(id)) {
            (ArgAction::SetTrue, _) => Value::Boolean(given.get_flag(id)),
            (_, None) => continue,
            (ArgAction::Append, _) => Value::Array(values),
            _ => values.into_iter().next().unwrap_or(Value::Boolean(true)),
        };
        table.insert(key.into(), value);
    }
    toml::to_string(&table).unwrap_or_default()
}

/// A number where the text is one, so that it looks as anyone would write it.
fn typed(text: &str) -> Value {
    let integer = text.parse().map(Value::Integer).ok();
    let float = || text.parse::<f64>().ok().filter(|x| x.is_finite()).map(Value::Float);
    integer.or_else(float).unwrap_or_else(|| Value::String(text.into()))
}
