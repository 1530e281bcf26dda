//! What `--help` and `--help-all` print.
//!
//! `--help` is one screen, written by hand: a text for each command beside this file. `--help-all` is
//! what clap makes of every flag, and docs/reference.md shows it.

use std::ffi::OsString;

use clap::{Arg, ArgAction, Command, CommandFactory};

use super::args::Cli;

/// The screens. A command without one shows clap's own short help.
static SCREENS: [(&str, &str); 8] = [
    ("render", include_str!("render.txt")),
    ("turntable", include_str!("turntable.txt")),
    ("assemble", include_str!("assemble.txt")),
    ("info", include_str!("info.txt")),
    ("bench", include_str!("bench.txt")),
    ("job", include_str!("job.txt")),
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
Exit codes: 0 all done; 1 something failed, and the rest was done; 2 the command line is wrong; 130 and \
143 interrupted or terminated, with no partial file left.";

/// The command line as clap knows it; its `--help` is the screens, unless `words` ask for everything.
pub(super) fn command_line(words: &[OsString]) -> Command {
    let everything = words.iter().take_while(|w| *w != "--").any(|w| w == "--help-all");
    let screen = |command: Command| {
        let screen = SCREENS.iter().find(|(name, _)| command.get_name() == *name);
        match screen {
            Some((_, screen)) if !everything => command.override_help(*screen),
            _ => command,
        }
    };
    let first = |cli: Command| if everything { cli.flatten_help(true) } else { cli.help_template(FIRST) };
    first(full().mut_subcommands(screen))
}

/// The command line with everything that is said about it.
pub(super) fn full() -> Command {
    help_flags(Cli::command())
        .after_long_help(EXIT_CODES)
        .mut_subcommands(|command| with_examples(help_flags(command)))
}

fn help_flags(command: Command) -> Command {
    let flag = |name: &'static str| Arg::new(name).long(name).help_heading("Process");
    command
        .disable_help_flag(true)
        .arg(flag("help").short('h').action(ArgAction::HelpShort).help("Prints one screen of help"))
        .arg(flag("help-all").action(ArgAction::HelpLong).help("Prints what every option does"))
}

/// The examples of a command's screen, below what clap says about it.
fn with_examples(command: Command) -> Command {
    let screen = SCREENS.iter().find(|(name, _)| command.get_name() == *name);
    match screen.and_then(|(_, text)| text.split("\n\n").find(|part| part.starts_with("Examples:"))) {
        Some(examples) => command.after_long_help(examples),
        None => command,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The arguments of a command and of those below it: a job's are its engines' and its frames'.
    fn arguments(command: &Command) -> Box<dyn Iterator<Item = &Arg> + '_> {
        Box::new(command.get_arguments().chain(command.get_subcommands().flat_map(arguments)))
    }

    /// What a screen says cannot drift from the flags that there are.
    #[test]
    fn screens_name_flags_that_exist_and_examples_that_parse() {
        let (mut flags, mut examples) = (0, 0);
        for (name, screen) in SCREENS {
            let cli = full();
            let command = cli.find_subcommand(name).expect(name);
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
                let words = line.split(" # ").next().into_iter().flat_map(str::split_whitespace);
                let parsed = full().try_get_matches_from(std::iter::once("blinn").chain(words));
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
                examples += 1;
            }
        }
        assert!(flags > 70 && examples > 10, "{flags} flags, {examples} examples");
    }

    #[test]
    fn every_headline_of_a_screen_is_its_command_s_own() {
        for (name, screen) in SCREENS {
            let cli = full();
            let about = cli.find_subcommand(name).and_then(Command::get_about).expect(name).to_string();
            assert!(screen.starts_with(&about), "{name}: {about}");
        }
    }
}
