//! What `--help` and `--help-all` print.
//!
//! `--help` is one screen, written by hand: a text for each command beside this file. `--help-all` is
//! what clap makes of every flag, and docs/reference/command-line.md shows it.

use std::ffi::OsString;

use clap::{Arg, ArgAction, Command, CommandFactory};

use crate::cli::args::Cli;

/// The screens, by the words that call a command.
static SCREENS: [(&str, &str); 10] = [
    ("render", include_str!("render.txt")),
    ("turntable", include_str!("turntable.txt")),
    ("assemble", include_str!("assemble.txt")),
    ("info", include_str!("info.txt")),
    ("bench", include_str!("bench.txt")),
    ("job", include_str!("job.txt")),
    ("job openjd", include_str!("job_openjd.txt")),
    ("job slurm", include_str!("job_slurm.txt")),
    ("completions", include_str!("completions.txt")),
    ("man", include_str!("man.txt")),
];

/// The program's first screen: its commands, and a first command to try.
const FIRST: &str = "\
{about}

Usage: blinn COMMAND …

{subcommands}

Examples:
  blinn render chair.obj                 # chair.png, framed and lit
  blinn turntable shoe.glb -o shoe.html  # turned by drag
  blinn info shot.glb                    # what is in it

blinn COMMAND --help is one screen about a command, --help-all all of it.
";

/// What a program exits with, for `--help-all` and man pages.
const EXIT_CODES: &str = "\
Exit codes: 0 all done; 1 something failed, and the rest was done; 2 the command line is wrong; 129, \
130 and 143 hung up, interrupted or terminated, with no partial file left.";

/// The command line as clap knows it; its `--help` is the screens, unless `words` ask for everything.
pub(crate) fn command_line(words: &[OsString]) -> Command {
    let everything = words.iter().take_while(|w| *w != "--").any(|w| w == "--help-all");
    if everything {
        return full().flatten_help(true);
    }
    all_below(full().help_template(FIRST), "", &|command, called| match screen(&command, called) {
        Some(screen) => command.override_help(screen),
        None => command,
    })
}

/// The command line with everything that is said about it.
pub(crate) fn full() -> Command {
    let said = |command, called: &str| with_examples(help_flags(command), called);
    all_below(help_flags(Cli::command()).after_long_help(EXIT_CODES), "", &said)
}

/// `command` with all commands below it as `change` makes them, which is told the words that call each.
fn all_below(command: Command, called: &str, change: &dyn Fn(Command, &str) -> Command) -> Command {
    command.mut_subcommands(|below| {
        let called = format!("{called} {}", below.get_name()).trim_start().to_string();
        all_below(change(below, &called), &called, change)
    })
}

fn written(called: &str) -> Option<&'static str> {
    SCREENS.iter().find(|(name, _)| *name == called).map(|(_, screen)| *screen)
}

/// The screen of a command that is called so. What a job renders takes the words of the command of that
/// name, so it has that one's screen with the job's own headline, usage and examples.
fn screen(command: &Command, called: &str) -> Option<String> {
    if let Some(screen) = written(called) {
        return Some(screen.to_string());
    }
    let (engine, name) = called.rsplit_once(' ')?;
    let calls = |text: &str| text.replace(&format!("blinn {name}"), &format!("blinn {called}"));
    let parts: Vec<&str> = written(name)?.split("\n\n").collect();
    let [_, usage, options, _, last] = parts[..] else { return None };
    let is_its = |line: &&str| !line.starts_with(' ') || line.contains(&format!(" {name} "));
    let examples: Vec<&str> = examples(engine)?.lines().filter(is_its).collect();
    let about = command.get_about()?;
    Some([&about.to_string(), &calls(usage), options, &examples.join("\n"), &calls(last)].join("\n\n"))
}

fn help_flags(command: Command) -> Command {
    let flag = |name: &'static str| Arg::new(name).long(name).help_heading("Process");
    command
        .disable_help_flag(true)
        .arg(flag("help").short('h').action(ArgAction::HelpShort).help("Prints one screen of help"))
        .arg(flag("help-all").action(ArgAction::HelpLong).help("Prints what every option does"))
}

/// The examples of a command's screen, below what clap says about it.
fn with_examples(command: Command, called: &str) -> Command {
    match examples(called) {
        Some(examples) => command.after_long_help(examples),
        None => command,
    }
}

/// The part of a screen that has its examples.
fn examples(called: &str) -> Option<&'static str> {
    written(called)?.split("\n\n").find(|part| part.starts_with("Examples:"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The arguments of a command and of those below it: a job's are its engines' and its frames'.
    fn arguments(command: &Command) -> Box<dyn Iterator<Item = &Arg> + '_> {
        Box::new(command.get_arguments().chain(command.get_subcommands().flat_map(arguments)))
    }

    /// The command that these words call.
    fn find<'c>(cli: &'c Command, called: &str) -> &'c Command {
        called.split(' ').fold(cli, |command, name| command.find_subcommand(name).expect(called))
    }

    /// What a screen says cannot drift from the flags that there are.
    #[test]
    fn screens_name_flags_that_exist_and_examples_that_parse() {
        let (mut flags, mut examples) = (0, 0);
        for (name, screen) in SCREENS {
            let cli = full();
            let command = find(&cli, name);
            for word in
                screen.split(|c: char| c.is_whitespace() || ":[,=".contains(c)).filter(|w| w.starts_with('-'))
            {
                let known = arguments(command).any(|arg| {
                    arg.get_long().is_some_and(|long| word.strip_prefix("--") == Some(long))
                        || arg.get_short().is_some_and(|short| word == format!("-{short}"))
                });
                assert!(known, "{name}: {word}");
                flags += 1;
            }
            for line in screen.lines().filter_map(|l| l.strip_prefix("  blinn ")) {
                // As a shell does it: what follows a bare number sign is a comment.
                let words = shlex::split(line).expect(line).into_iter().take_while(|word| word != ">");
                let parsed = full().try_get_matches_from(std::iter::once("blinn".into()).chain(words));
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
                examples += 1;
            }
        }
        assert!(flags > 70 && examples > 10, "{flags} flags, {examples} examples");
    }

    /// What a job renders shows the options of the command of that name, as the job's.
    #[test]
    fn frames_of_a_job_have_a_screen_too() {
        for engine in ["openjd", "slurm"] {
            for name in ["render", "turntable"] {
                let called = format!("job {engine} {name}");
                let screen = screen(find(&full(), &called), &called).expect(&called);
                assert!(screen.contains(&format!("Usage: blinn {called} SCENE")), "{screen}");
                assert!(screen.contains("--orbit") && screen.contains(&format!("blinn {called} --help-all")));
                let examples: Vec<&str> = screen.lines().filter(|l| l.starts_with("  blinn ")).collect();
                assert!(examples.len() == 1 && examples[0].contains(&format!(" {name} ")), "{examples:?}");
            }
        }
    }

    #[test]
    fn every_headline_of_a_screen_is_its_command_s_own() {
        for (name, screen) in SCREENS {
            let cli = full();
            let about = find(&cli, name).get_about().expect(name).to_string();
            assert!(screen.starts_with(&about), "{name}: {about}");
        }
    }
}
