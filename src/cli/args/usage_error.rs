//! A wrong command line in one line: what is wrong, and what would be right.

use std::ffi::OsString;
use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Error};

use crate::cli::args::{config, foreign_flags, help};

/// One line for what clap found wrong with `words`, which are those that were `given` and those of a file.
pub(crate) fn one_line(error: &Error, words: &[OsString], given: &[OsString]) -> String {
    let line = of_words(error, words);
    let refused = matches!(error.kind(), ErrorKind::InvalidValue | ErrorKind::ValueValidation);
    let flag = Context(error).text(ContextKind::InvalidArg).filter(|_| refused);
    let stands_in = |words: &[OsString], flag: &str| {
        words.iter().any(|word| word.to_str().is_some_and(|word| word.split('=').next() == Some(flag)))
    };
    let of_file = |flag: String| stands_in(words, bare(&flag)) && !stands_in(given, bare(&flag));
    match config::file_of(given).filter(|_| flag.is_some_and(of_file)) {
        Some(file) => format!("--config {}: {line}", file.display()),
        None => line,
    }
}

fn of_words(error: &Error, words: &[OsString]) -> String {
    let cli = help::full();
    let context = Context(error);
    let flag = context.text(ContextKind::InvalidArg);
    let called = called(&cli, words, flag.as_deref());
    let names: Vec<&str> = called.iter().map(|command| command.get_name()).collect();
    let name = names.join(" ");
    let value = context.text(ContextKind::InvalidValue).unwrap_or_default();
    match (error.kind(), flag) {
        (ErrorKind::UnknownArgument, Some(flag)) => unknown(&called, &name, &flag, &context),
        (ErrorKind::InvalidValue, Some(flag)) => {
            let possible = context.list(ContextKind::ValidValue).join(", ");
            let possible =
                if possible.is_empty() { String::new() } else { format!("; possible values: {possible}") };
            match value.as_str() {
                "" if possible.is_empty() => format!("{} needs a value: {}", bare(&flag), placeholder(&flag)),
                "" => format!("{} needs a value{possible}", bare(&flag)),
                value => format!("{} cannot be '{value}'{possible}{}", bare(&flag), context.did_you_mean()),
            }
        }
        (ErrorKind::ValueValidation, Some(flag)) => {
            let written = called.last().and_then(|command| as_written(command, bare(&flag), words));
            format!("{} {value}: {}", written.as_deref().unwrap_or(bare(&flag)), reason(error))
        }
        (ErrorKind::ArgumentConflict, Some(flag)) => match &context.list(ContextKind::PriorArg)[..] {
            [prior] if *prior == flag => format!("{} cannot be given twice", bare(&flag)),
            others => {
                let others: Vec<&str> = others.iter().map(|o| bare(o)).collect();
                format!("{} cannot be used with {}", bare(&flag), others.join(", "))
            }
        },
        (ErrorKind::MissingRequiredArgument, _) => {
            let missing = context.list(ContextKind::InvalidArg);
            let missing: Vec<String> =
                missing.iter().map(|m| m.replace(['<', '>'], "").replace("...", "")).collect();
            format!("{name} needs {}: see {name} --help", missing.join(", "))
        }
        (ErrorKind::MissingSubcommand, _) => {
            let below: Vec<&str> = called
                .last()
                .map_or(Vec::new(), |last| last.get_subcommands().map(Command::get_name).collect());
            format!("{name} needs {}: see {name} --help", below.join(" or "))
        }
        (ErrorKind::InvalidSubcommand, _) => {
            let word = context.text(ContextKind::InvalidSubcommand).unwrap_or_default();
            no_command(&cli, &word, &context)
        }
        _ => clap_s_own(error),
    }
}

/// The commands that words call before `flag`, one below the other: the program, `job`, `slurm`, `render`.
fn called<'c>(cli: &'c Command, words: &[OsString], flag: Option<&str>) -> Vec<&'c Command> {
    let is_flag = |word: &OsString| word.to_str().is_some_and(|w| w.split('=').next() == flag);
    let mut called = vec![cli];
    for word in words.iter().skip(1).take_while(|word| !is_flag(word)) {
        called.extend(called.last().and_then(|command| command.find_subcommand(word)));
    }
    called
}

/// The other name of a flag by which `words` call it, if they do.
fn as_written(command: &Command, flag: &str, words: &[OsString]) -> Option<String> {
    let long = flag.strip_prefix("--")?;
    let others = command.get_arguments().find(|arg| arg.get_long() == Some(long))?.get_all_aliases()?;
    let names = words.iter().filter_map(|word| word.to_str()?.strip_prefix("--")?.split('=').next());
    names.into_iter().find(|name| others.contains(name)).map(|name| format!("--{name}"))
}

/// A flag that the last of the called commands has not: another program's, another command's, or misspelt.
fn unknown(called: &[&Command], name: &str, flag: &str, context: &Context) -> String {
    let has = |command: &Command| flag.strip_prefix("--").is_some_and(|long| has(command, long));
    let names = |command: &Command, before: &str| -> Vec<String> {
        let with = command.get_subcommands().filter(|c| has(c));
        with.map(|c| format!("{before}{}", c.get_name())).collect()
    };
    let what = format!("{name} has no {flag}");
    if let [.., above, last] = called {
        if let [first, ..] = &names(last, "")[..] {
            return format!("{what}: it stands behind {first}");
        }
        if has(above) {
            return format!("{what}: it stands before {}", last.get_name());
        }
    }
    let others = called.first().map_or(Vec::new(), |cli| names(cli, "blinn "));
    if let Some(here) = foreign_flags::called_here(flag) {
        return match here.strip_prefix("nothing: ") {
            Some(why) => format!("{what}, and needs none: {why}"),
            None => format!("{what}: here it is {here}"),
        };
    }
    match &others[..] {
        [] if !flag.starts_with('-') => format!("{name} has no use for '{flag}'"),
        [] => match context.did_you_mean() {
            suggestion if suggestion.is_empty() => format!("{what}: {name} --help-all lists what there is"),
            suggestion => format!("{what}{suggestion}"),
        },
        some => format!("{what}: it belongs to {}", some.join(" and ")),
    }
}

fn has(command: &Command, long: &str) -> bool {
    let is = |arg: &clap::Arg| {
        arg.get_long() == Some(long) || arg.get_all_aliases().is_some_and(|all| all.contains(&long))
    };
    command.get_arguments().any(is)
}

/// A first word that is no command, perhaps a scene.
fn no_command(cli: &Command, word: &str, context: &Context) -> String {
    let is_scene = |ending: &str| ["glb", "gltf", "obj"].iter().any(|e| ending.eq_ignore_ascii_case(e));
    if Path::new(word).extension().and_then(|e| e.to_str()).is_some_and(is_scene) {
        return format!("'{word}' is no command: to render it, say blinn render {word}");
    }
    match context.did_you_mean() {
        suggestion if suggestion.is_empty() => {
            let all: Vec<&str> = cli.get_subcommands().map(Command::get_name).collect();
            format!("there is no command '{word}': there are {}", all.join(", "))
        }
        suggestion => format!("there is no command '{word}'{suggestion}"),
    }
}

/// Why a value was refused. The standard library's own words say nothing to a reader.
fn reason(error: &Error) -> String {
    let said = std::error::Error::source(error).map(ToString::to_string).unwrap_or_default();
    match said.as_str() {
        "invalid digit found in string" | "cannot parse integer from empty string" => {
            "expected a whole number".to_string()
        }
        _ => said,
    }
}

/// The first line of what clap says.
fn clap_s_own(error: &Error) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_string()
}

/// A flag without its value's name: `--size <WxH>` is `--size`, and `[SCENE]...` is `SCENE`.
fn bare(flag: &str) -> &str {
    let word = |c: char| !c.is_whitespace() && !"=<>[].".contains(c);
    flag.split(|c| !word(c)).find(|part| !part.is_empty()).unwrap_or(flag)
}

/// The name of a flag's value: `WxH` of `--size <WxH>`.
fn placeholder(flag: &str) -> &str {
    flag.split_once('<').map_or("", |(_, name)| name.trim_end_matches(['>', '.', ']']))
}

/// What clap knows about an error.
struct Context<'e>(&'e Error);

impl Context<'_> {
    fn list(&self, kind: ContextKind) -> Vec<String> {
        match self.0.get(kind) {
            Some(ContextValue::String(one)) => vec![one.clone()],
            Some(ContextValue::Strings(all)) => all.clone(),
            _ => Vec::new(),
        }
    }

    fn text(&self, kind: ContextKind) -> Option<String> {
        self.list(kind).into_iter().next()
    }

    /// `: did you mean …?`, or nothing.
    fn did_you_mean(&self) -> String {
        let kinds =
            [ContextKind::SuggestedArg, ContextKind::SuggestedSubcommand, ContextKind::SuggestedValue];
        let found = kinds.into_iter().find_map(|kind| self.text(kind));
        found.map_or(String::new(), |word| format!(": did you mean {word}?"))
    }
}
