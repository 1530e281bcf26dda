//! Arguments of commands, with the flags for help: defined only for the command that is given.

use std::ops::Deref;

use clap::builder::Resettable;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches};

/// The arguments `T` of a command without commands below it, and the flags for its help.
///
/// clap defines them when a command line names the command: those of all commands take longer than a small picture.
pub type CommandArgs<T> = Defined<T, true>;

/// The arguments `T` of a command with commands below it, and the flags for its help.
pub type CommandGroup<T> = Defined<T, false>;

/// Arguments of a command, which are defined when a command line names it if `DEFERRED`, else with the command.
#[derive(Debug)]
pub struct Defined<T, const DEFERRED: bool>(Box<T>);

impl<T, const DEFERRED: bool> Deref for Defined<T, DEFERRED> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: Args, const DEFERRED: bool> Args for Defined<T, DEFERRED> {
    fn augment_args(command: Command) -> Command {
        if DEFERRED { command.defer(define::<T>) } else { define::<T>(command) }
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<T: FromArgMatches, const DEFERRED: bool> FromArgMatches for Defined<T, DEFERRED> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        T::from_arg_matches(matches).map(Box::new).map(Defined)
    }

    fn from_arg_matches_mut(matches: &mut ArgMatches) -> Result<Self, Error> {
        T::from_arg_matches_mut(matches).map(Box::new).map(Defined)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        self.0.update_from_arg_matches(matches)
    }
}

fn define<T: Args>(command: Command) -> Command {
    // clap takes the documentation of flattened groups for that of the command.
    let about = Resettable::from(command.get_about().cloned());
    let long_about = Resettable::from(command.get_long_about().cloned());
    let command = T::augment_args(command).about(about).long_about(long_about);
    add_help_flags(command).mut_args(ignore_case_of_choices)
}

/// Adds `-h` and `--help`, in place of clap's.
pub fn add_help_flags(command: Command) -> Command {
    let flag = |name: &'static str| Arg::new(name).help_heading("Process");
    let short = flag("help-short").short('h').action(ArgAction::HelpShort);
    let long = flag("help").long("help").alias("help-all").action(ArgAction::HelpLong);
    command
        .disable_help_flag(true)
        .arg(short.help("Print a line for each common option"))
        .arg(long.help("Print help for every option"))
}

/// Accepts the values of a fixed set in upper and lower case: Blender writes AgX, PNG and CYCLES.
fn ignore_case_of_choices(arg: Arg) -> Arg {
    let has_choices = arg.get_action().takes_values() && !arg.get_possible_values().is_empty();
    arg.ignore_case(has_choices)
}
