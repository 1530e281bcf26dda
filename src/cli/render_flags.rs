//! Plans from flags that other parts of the program compose, as if they were typed.

use std::ffi::OsString;
use std::path::Path;

use clap::FromArgMatches;

use super::args::{Cli, Command};
use super::args::{argv, help, usage_error};
use super::plan::RenderPlan;
use super::usage::UsageError;

/// Resolves flags of `blinn render` and a scene into a plan.
///
/// # Errors
/// Those of the command line.
pub fn render_plan(flags: Vec<OsString>, scene: &Path) -> Result<RenderPlan, UsageError> {
    match parse("render", flags, scene)? {
        Command::Render(args) => RenderPlan::for_render(&args),
        _ => Err(UsageError("these are not flags of blinn render".into())),
    }
}

/// Resolves flags of `blinn turntable` and a scene into a plan.
///
/// # Errors
/// Those of the command line.
pub fn turntable_plan(flags: Vec<OsString>, scene: &Path) -> Result<RenderPlan, UsageError> {
    match parse("turntable", flags, scene)? {
        Command::Turntable(args) => RenderPlan::for_turntable(&args),
        _ => Err(UsageError("these are not flags of blinn turntable".into())),
    }
}

fn parse(command: &str, flags: Vec<OsString>, scene: &Path) -> Result<Command, UsageError> {
    let mut arguments: Vec<OsString> = ["blinn", command].map(OsString::from).into();
    arguments.extend(flags);
    arguments.extend(["--".into(), scene.into()]);
    let arguments = argv::join_values(arguments);
    let matches = help::command(&arguments).try_get_matches_from(&arguments);
    let cli = matches
        .and_then(|matches| Cli::from_arg_matches(&matches))
        .map_err(|error| UsageError(usage_error::message(&error, &arguments, &arguments)))?;
    Ok(cli.command)
}
