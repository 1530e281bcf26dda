//! Messages for wrong command lines: clap's own on one line, with hints that clap does not have.

use std::ffi::OsString;
use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Error};

use blinn_core::closest_name::closest_name;
use blinn_core::option_words::option_word;
use blinn_core::worded;
use blinn_session::SCENE_EXTENSIONS;
use blinn_session::values::NAMED_DIRECTIONS;

use super::command_tree::{built, find_flag};
use super::foreign_words::Equivalent;
use super::{config, foreign_words};
use crate::option_words;

/// Message for a clap error in one line. `argv` is the `command_line` with the options of its --config file.
pub fn message(error: &Error, argv: &[OsString], command_line: &[OsString]) -> String {
    let flag = context(error, ContextKind::InvalidArg);
    let text = match (error.kind(), &flag) {
        (ErrorKind::UnknownArgument, Some(flag)) => unknown_argument(flag, argv),
        (ErrorKind::InvalidSubcommand, _) => unknown_command(error),
        (ErrorKind::ArgumentConflict, _) => {
            clap_message(error) + &elevation_of_views(error).unwrap_or_default()
        }
        (ErrorKind::InvalidValue, Some(flag)) => {
            clap_message(error)
                + &help_of_missing(error, flag, argv)
                + &named_direction(error).unwrap_or_default()
        }
        _ => clap_message(error),
    };
    let is_value_error = matches!(error.kind(), ErrorKind::InvalidValue | ErrorKind::ValueValidation);
    let is_from_file = |flag: &str| contains_flag(argv, flag) && !contains_flag(command_line, flag);
    match config::file_name(command_line) {
        Some(file) if is_value_error && flag.is_some_and(|flag| is_from_file(flag_name(&flag))) => {
            worded!("`config` {}: {}", file.display(), text)
        }
        _ => text,
    }
}

/// The help of a flag whose value is missing, unless clap lists all values.
fn help_of_missing(error: &Error, flag: &str, argv: &[OsString]) -> String {
    let is_missing = context(error, ContextKind::InvalidValue).is_some_and(|value| value.is_empty());
    let has_choices =
        matches!(error.get(ContextKind::ValidValue), Some(ContextValue::Strings(texts)) if !texts.is_empty());
    if !is_missing || has_choices {
        return String::new();
    }
    let (root, name) = (built(), flag_name(flag));
    let commands = command_path(&root, argv, name);
    let flag = commands.last().and_then(|command| find_flag(command, name.trim_start_matches('-')));
    let help = flag.and_then(|flag| flag.get_help()).map(|help| help.to_string()).unwrap_or_default();
    help.lines().next().map(|line| format!(": {line}")).unwrap_or_default()
}

/// The hint for a direction as the value of --view, which is the view transform.
fn named_direction(error: &Error) -> Option<String> {
    let flag = context(error, ContextKind::InvalidArg).filter(|flag| flag_name(flag) == "--view");
    let value = flag.and_then(|_| context(error, ContextKind::InvalidValue))?;
    let is_direction = NAMED_DIRECTIONS.into_iter().any(|(name, ..)| name == value);
    is_direction.then(|| worded!("; use `orbit` {} to choose the camera", value))
}

/// The hint for --elevation, which is that of the camera of a turntable, beside --views.
fn elevation_of_views(error: &Error) -> Option<String> {
    let flags = [ContextKind::InvalidArg, ContextKind::PriorArg].map(|kind| context(error, kind));
    let has = |name: &str| flags.iter().flatten().any(|flag| flag_name(flag) == name);
    (has("--elevation") && has("--views"))
        .then(|| worded!("; use `elevation-range` LO,HI for the views of a dataset"))
}

/// clap's message without usage and help, joined to one line.
fn clap_message(error: &Error) -> String {
    let text = error.render().to_string();
    let lines = text.lines().map(str::trim);
    let lines =
        lines.take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"));
    let mut message = String::new();
    for line in lines.filter(|line| !line.is_empty()) {
        message += match &message {
            m if m.is_empty() || m.ends_with(':') => " ",
            _ => "; ",
        };
        message += line;
    }
    // The standard library's reason does not say what to do.
    let message = message.replace("invalid digit found in string", "expected a whole number");
    let message = message.trim_start().trim_start_matches("error: ").to_string();
    [ContextKind::InvalidArg, ContextKind::PriorArg]
        .into_iter()
        .flat_map(|kind| contexts(error, kind))
        .fold(message, with_word)
}

/// A message of clap with another program's word for a flag that it names, such as `--size <WxH>`.
fn with_word(message: String, flag: String) -> String {
    let name = flag_name(&flag).trim_start_matches('-');
    let word = option_word(name, None);
    if word == option_words::flag(name, None) {
        return message;
    }
    message.replace(&format!("'{flag}'"), &word).replace(&flag, &word)
}

/// A flag that the command does not have: another program's, another command's, or misspelt.
fn unknown_argument(flag: &str, argv: &[OsString]) -> String {
    let root = built();
    let commands = command_path(&root, argv, flag);
    let long = flag.strip_prefix("--").unwrap_or_default();
    let with_flag = |command: &Command| -> Vec<String> {
        let below = command.get_subcommands().filter(|below| find_flag(below, long).is_some());
        below.map(|below| below.get_name().to_string()).collect()
    };
    if let [.., above, last] = &commands[..] {
        if let Some(below) = with_flag(last).first() {
            return format!("unexpected argument '{flag}': place it after {below}");
        }
        if find_flag(above, long).is_some() {
            return format!("unexpected argument '{flag}': place it before {}", last.get_name());
        }
    }
    // clap suggests flags that are not close.
    let longs: Vec<&str> = commands.last().into_iter().flat_map(|command| long_flags(command)).collect();
    let suggestion = closest_name(long, longs).map(|similar| format!("--{similar}"));
    let other_commands = match &with_flag(&root)[..] {
        [] => String::new(),
        [one] => one.clone(),
        [others @ .., last] => format!("{} and blinn {last}", others.join(", blinn ")),
    };
    let of_command =
        commands.last().and_then(|command| foreign_words::flag_of_command(command.get_name(), flag));
    let hint = match (of_command, foreign_words::flag(flag), suggestion) {
        (Some(hint), ..) => hint.to_string(),
        (_, Some(Equivalent::Use(option)), _) => format!("use {option}"),
        (_, Some(Equivalent::Unneeded(reason)), _) => format!("not needed, {reason}"),
        _ if !other_commands.is_empty() => format!("it is an option of blinn {other_commands}"),
        (_, None, Some(similar)) => format!("did you mean {similar}?"),
        (_, None, None) => {
            let path: Vec<&str> = commands.iter().map(|command| command.get_name()).collect();
            format!("see {} --help", path.join(" "))
        }
    };
    format!("unexpected argument '{flag}': {hint}")
}

/// A first word that is no command, perhaps a scene.
fn unknown_command(error: &Error) -> String {
    let word = context(error, ContextKind::InvalidSubcommand).unwrap_or_default();
    let extension = Path::new(&word).extension().and_then(|e| e.to_str()).unwrap_or_default();
    if SCENE_EXTENSIONS.iter().any(|scene| extension.eq_ignore_ascii_case(scene)) {
        return format!("unknown command '{word}': to render it, use blinn render {word}");
    }
    let root = built();
    let hint = match (
        foreign_words::command(&word),
        closest_name(&word, root.get_subcommands().map(Command::get_name)),
    ) {
        (Some(usage), _) => format!("use {usage}"),
        (None, Some(similar)) => format!("did you mean {similar}?"),
        (None, None) => "see blinn --help".into(),
    };
    format!("unknown command '{word}': {hint}")
}

/// The names of a command's flags, without `--` and without those that help does not show.
pub fn shown_flags(command: &str) -> Vec<String> {
    let root = built();
    let command = root.find_subcommand(command);
    command.into_iter().flat_map(long_flags).map(str::to_string).collect()
}

/// True if a command has a flag of a name without `--`, or of an alias.
pub fn has_flag(command: &str, name: &str) -> bool {
    built().find_subcommand(command).is_some_and(|command| find_flag(command, name).is_some())
}

/// The names of a command's flags, without `--`.
fn long_flags(command: &Command) -> Vec<&str> {
    let shown = command.get_arguments().filter(|argument| !argument.is_hide_set());
    shown.filter_map(|argument| argument.get_long()).collect()
}

/// The commands in `argv` before `flag`, from the program down.
fn command_path<'c>(root: &'c Command, argv: &[OsString], flag: &str) -> Vec<&'c Command> {
    let is_flag = |arg: &OsString| arg.to_str().and_then(|arg| arg.split('=').next()) == Some(flag);
    let mut path = vec![root];
    for arg in argv.iter().skip(1).take_while(|arg| !is_flag(arg)) {
        path.extend(path.last().and_then(|command| command.find_subcommand(arg)));
    }
    path
}

fn contains_flag(argv: &[OsString], flag: &str) -> bool {
    argv.iter().any(|arg| arg.to_str().and_then(|arg| arg.split('=').next()) == Some(flag))
}

/// A flag without the name of its value: `--size` of `--size <WxH>`.
fn flag_name(flag: &str) -> &str {
    flag.split([' ', '=', '[']).next().unwrap_or(flag)
}

/// The first text that clap attached to an error for a kind of context.
fn context(error: &Error, kind: ContextKind) -> Option<String> {
    contexts(error, kind).into_iter().next()
}

/// The texts that clap attached to an error for a kind of context.
fn contexts(error: &Error, kind: ContextKind) -> Vec<String> {
    match error.get(kind) {
        Some(ContextValue::String(text)) => vec![text.clone()],
        Some(ContextValue::Strings(texts)) => texts.clone(),
        _ => Vec::new(),
    }
}
