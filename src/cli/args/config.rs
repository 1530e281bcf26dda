//! Settings from a file: `--config FILE.toml` has flags by their names, and the command line wins.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Command, Id};
use toml::{Table, Value};

use crate::cli::Usage;
use crate::cli::args::help;

/// Flags that no file sets.
const NOT_SETTINGS: [&str; 4] = ["config", "print-config", "help", "help-all"];

/// The words of a command line, with those of its `--config` file put in where it says nothing
/// itself.
pub(crate) fn with_file(mut words: Vec<OsString>) -> Result<Vec<OsString>, Usage> {
    // What is still missing may be in the file, so this look does not mind.
    let look = help::full().ignore_errors(true);
    let lenient = look.clone().try_get_matches_from(&words);
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
    // Directly behind the command's name, which is not the first word that reads like it: that may be a value.
    let calls = |count: &usize| {
        let begin = look.clone().try_get_matches_from(&words[..*count]);
        begin.as_ref().ok().and_then(deepest).is_some_and(|(called, _)| called == path_of)
    };
    let place = (1..=words.len()).find(calls).unwrap_or(words.len());
    words.splice(place..place, from_file);
    Ok(words)
}

/// The settings file that a command line names.
pub(crate) fn file_of(words: &[OsString]) -> Option<PathBuf> {
    let given = help::full().ignore_errors(true).try_get_matches_from(words).ok()?;
    deepest(&given)?.1.try_get_one::<PathBuf>("config").ok().flatten().cloned()
}

/// The names of the commands in a command line, such as `job`, `slurm` and `render`, and what was given to
/// the last of them.
pub(crate) fn deepest(matches: &ArgMatches) -> Option<(Vec<&str>, &ArgMatches)> {
    let (mut names, mut given) = (Vec::new(), matches);
    while let Some((name, below)) = given.subcommand() {
        names.push(name);
        given = below;
    }
    (!names.is_empty()).then_some((names, given))
}

/// The program's words, with those that clap adds.
pub(crate) fn built() -> Command {
    let mut cli = help::full();
    cli.build();
    cli
}

/// The command that is called so.
pub(crate) fn command_at<'c>(cli: &'c Command, names: &[&str]) -> Option<&'c Command> {
    names.iter().try_fold(cli, |command, name| command.find_subcommand(name))
}

/// What `table` says and the command line does not, nor anything that excludes it.
fn in_words(command: &Command, given: &ArgMatches, table: &Table) -> Result<Vec<OsString>, String> {
    let all_given = all_given(command, given);
    let mut words = Vec::new();
    for (key, value) in table {
        let named = |arg: &&Arg| name(arg) == Some(key.as_str()) && !NOT_SETTINGS.contains(&key.as_str());
        let Some(arg) = command.get_arguments().find(named) else {
            return Err(format!("'{key}' is no setting of {}", command.get_name()));
        };
        if all_given.contains(&arg.get_id()) || excluded(command, arg, &all_given) {
            continue;
        }
        let values = texts(arg, value).ok_or_else(|| format!("'{key}' cannot be {value}"))?;
        for text in values {
            words.push(match text {
                // Among options, what begins with a dash would be one.
                Some(text) if arg.is_positional() && text.starts_with('-') => format!("./{text}").into(),
                Some(text) if arg.is_positional() => text.into(),
                Some(text) => format!("--{key}={text}").into(),
                None => format!("--{key}").into(),
            });
        }
    }
    Ok(words)
}

/// What the command line gives itself.
fn all_given<'c>(command: &'c Command, given: &ArgMatches) -> Vec<&'c Id> {
    let is_given = |id: &&Id| given.value_source(id.as_str()) == Some(ValueSource::CommandLine);
    command.get_arguments().map(Arg::get_id).filter(is_given).collect()
}

/// Whether any of the flags that were given excludes another.
fn excluded(command: &Command, arg: &Arg, all_given: &[&Id]) -> bool {
    let excludes = |one: &Arg, other: &Id| {
        command.get_arg_conflicts_with(one).iter().any(|conflict| conflict.get_id() == other)
    };
    let given = command.get_arguments().filter(|g| all_given.contains(&g.get_id()));
    given.into_iter().any(|g| excludes(g, arg.get_id()) || excludes(arg, g.get_id()))
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
        // A list of numbers is one value; an empty one is none.
        Value::Array(list) if repeats && (list.is_empty() || !list.iter().all(Value::is_number)) => {
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

/// All settings of a command line with their defaults, as a file that `--config` takes; but no defaults of
/// what excludes something that was given.
///
/// # Errors
/// Such a file is UTF-8, and a value is not.
pub(crate) fn print(words: &[OsString]) -> Result<String, Usage> {
    let matches = help::full().try_get_matches_from(words);
    let Some((names, given)) = matches.as_ref().ok().and_then(deepest) else {
        return Ok(String::new());
    };
    let cli = built();
    let Some(command) = command_at(&cli, &names) else { return Ok(String::new()) };
    let all_given = all_given(command, given);
    let mut table = Table::new();
    for arg in command.get_arguments() {
        let Some(key) = name(arg).filter(|key| !NOT_SETTINGS.contains(key)) else { continue };
        if excluded(command, arg, &all_given) {
            continue;
        }
        if let Some(value) = value(arg, given)? {
            table.insert(key.into(), value);
        }
    }
    Ok(toml::to_string(&table).unwrap_or_default())
}

/// What a file says of a flag that was given so, or by default.
fn value(arg: &Arg, given: &ArgMatches) -> Result<Option<Value>, Usage> {
    let id = arg.get_id().as_str();
    if matches!(arg.get_action(), ArgAction::SetTrue) {
        return Ok(Some(Value::Boolean(given.get_flag(id))));
    }
    if given.value_source(id).is_none() {
        return Ok(None);
    }
    let mut texts = Vec::new();
    for raw in given.try_get_raw(id).ok().flatten().into_iter().flatten() {
        let text = raw.to_str().ok_or_else(|| {
            let name = name(arg).unwrap_or(id);
            Usage(format!("--print-config: {name} {} is not UTF-8, as the file has to be", raw.display()))
        })?;
        texts.push(text);
    }
    Ok(Some(match (arg.get_action(), &texts[..]) {
        // In a list, numbers would be those of one value.
        (ArgAction::Append, _) => Value::Array(texts.into_iter().map(Value::from).collect()),
        (_, []) => Value::Boolean(true),
        (_, [first, ..]) => typed(first),
    }))
}

/// A number where the text is how numbers are written, so that it looks as anyone would write it.
fn typed(written: &str) -> Value {
    let integer = written.parse().map(Value::Integer).ok();
    let float = || written.parse().map(Value::Float).ok();
    let number = integer.or_else(float).filter(|number| text(number).as_deref() == Some(written));
    number.unwrap_or_else(|| written.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<OsString> {
        line.split(' ').filter(|word| !word.is_empty()).map(OsString::from).collect()
    }

    /// Everything that words say, and where they say nothing the defaults; `None` where they are wrong.
    fn meant(words: &[OsString]) -> Option<Vec<(String, Vec<OsString>)>> {
        let matches = help::full().try_get_matches_from(words).ok()?;
        let (names, given) = deepest(&matches)?;
        let raw = |arg: &Arg| {
            let values = given.try_get_raw(arg.get_id().as_str()).ok().flatten();
            let values = values.into_iter().flatten().map(OsString::from).collect();
            Some((name(arg).filter(|name| !NOT_SETTINGS.contains(name))?.to_string(), values))
        };
        Some(command_at(&built(), &names)?.get_arguments().filter_map(raw).collect())
    }

    /// Values one of which suits any option, first those that are easily taken for others.
    const VALUES: [&str; 14] = [
        "007", "-1,2,3", "0,.5,1", "1,2,3,4", "1-3", "1/2", "32x18", "0.50", "16", "depth,uv", "file",
        "none", "off", "steps",
    ];

    /// A line that gives an option a value, and what else it needs.
    fn a_line_with(arg: &Arg, called: &str) -> Option<String> {
        let flag = format!("--{}", arg.get_long()?);
        let possible = arg.get_possible_values();
        let own = possible.iter().rev().map(|value| value.get_name());
        let given = own.chain(VALUES).map(|value| match arg.get_action() {
            ArgAction::SetTrue => flag.clone(),
            ArgAction::Append => format!("{flag}={value} {flag}={value}"),
            _ => format!("{flag}={value}"),
        });
        let with = |given: String| {
            ["", "--frames=1-3", "--views=3"].map(|more| format!("blinn {called} {given} {more} 1.50 007"))
        };
        given.flat_map(with).find(|line| meant(&words(line)).is_some())
    }

    #[test]
    fn what_is_printed_means_what_was_given() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("c.toml");
        let mut options = 0;
        for called in ["render", "turntable", "job slurm render"] {
            let (cli, names) = (built(), called.split(' ').collect::<Vec<_>>());
            let settings = command_at(&cli, &names).unwrap().get_arguments();
            for arg in settings.filter(|arg| arg.get_long().is_some_and(|l| !NOT_SETTINGS.contains(&l))) {
                let line = a_line_with(arg, called).unwrap_or_else(|| panic!("no value suits {arg}"));
                let printed = print(&words(&line)).unwrap();
                std::fs::write(&file, &printed).unwrap();
                let taken = format!("blinn {called} --config {}", file.display());
                let taken = meant(&with_file(words(&taken)).unwrap());
                assert!(taken.is_some() && taken == meant(&words(&line)), "{line}: {printed}");
                options += 1;
            }
        }
        assert!(options > 150, "{options}");
    }

    /// A value may read like the command.
    #[test]
    fn settings_stand_behind_the_command_they_are_of() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("c.toml");
        std::fs::write(&file, "samples = 9").unwrap();
        let rest = format!("a.glb --frames=1-2 --config {}", file.display());
        for before in ["job slurm -o render render", "job slurm render", "job openjd --output=render render"]
        {
            let expected = words(&format!("blinn {before} --samples=9 {rest}"));
            assert_eq!(with_file(words(&format!("blinn {before} {rest}"))).unwrap(), expected);
        }
    }

    #[test]
    fn an_empty_list_says_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("c.toml");
        std::fs::write(&file, "hide = []\nsun = []\nscenes = []").unwrap();
        let line = words(&format!("blinn render a.glb --config {}", file.display()));
        assert_eq!(with_file(line.clone()).unwrap(), line);
    }

    #[test]
    fn a_scene_of_a_file_is_no_option() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("c.toml");
        std::fs::write(&file, "scenes = [\"-a.glb\"]").unwrap();
        let line = format!("blinn render --config {}", file.display());
        assert_eq!(with_file(words(&line)).unwrap()[2], "./-a.glb");
    }

    #[cfg(unix)]
    #[test]
    fn what_a_file_cannot_say_is_not_printed() {
        use std::os::unix::ffi::OsStringExt;
        let mut words = words("blinn render");
        words.push(OsString::from_vec(b"m\xff.glb".to_vec()));
        assert!(print(&words).unwrap_err().0.contains("not UTF-8"));
    }
}
