//! Lookups in the tree of commands: `job`, below it `slurm`, below that `render`.

use clap::{Arg, ArgMatches, Command};

use super::help;

/// The command tree with the arguments of all commands, without what clap adds.
pub fn built() -> Command {
    let mut root = help::full().disable_help_subcommand(true).disable_version_flag(true);
    root.build();
    root
}

/// The command at a path of names, if it exists.
pub fn find_command<'c>(root: &'c Command, path: &[&str]) -> Option<&'c Command> {
    path.iter().try_fold(root, |command, name| command.find_subcommand(name))
}

/// A parsed command: the path of names that leads to it, and its arguments.
pub struct MatchedCommand<'m> {
    pub path: Vec<&'m str>,
    pub matches: &'m ArgMatches,
}

/// The innermost command of a command line; `None` without any command.
pub fn innermost(matches: &ArgMatches) -> Option<MatchedCommand<'_>> {
    let mut path = Vec::new();
    let mut matches = matches;
    while let Some((name, below)) = matches.subcommand() {
        path.push(name);
        matches = below;
    }
    (!path.is_empty()).then_some(MatchedCommand { path, matches })
}

/// The argument of a command that has a long name or alias.
pub fn find_flag<'c>(command: &'c Command, long: &str) -> Option<&'c Arg> {
    let has_name = |arg: &&Arg| {
        arg.get_long() == Some(long) || arg.get_all_aliases().is_some_and(|all| all.contains(&long))
    };
    command.get_arguments().find(has_name)
}
