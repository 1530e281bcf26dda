//! The parts of the command line that the Python module uses: options by name, plans and render sessions.
//!
//! This is the only way from the module to the command line. Keyword arguments become flags, and pictures come from the
//! same sessions, so that they equal those of the command bit for bit.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;

use clap::{ArgAction, Args, Command};

use super::args::{RenderOptionArgs, SceneArgs};
use super::render_flags;
use super::{Host, run_arguments};

use blinn_session::SessionPlan;

pub use super::info::scene_properties;
pub use super::run::panics::{catch as catch_panic, install_hook as install_panic_hook};

/// Stands for a scene that is already loaded where the parser needs a path. No file has this name.
const LOADED_SCENE: &str = "blinn/loaded\u{1}scene";

/// Options by name without dashes in front.
pub type Options = BTreeMap<String, Repetition>;

/// True if a flag may be repeated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repetition(pub bool);

/// Returns the options that decide the pixels.
pub fn render_options() -> Options {
    options(RenderOptionArgs::augment_args(Command::new("")))
}

/// Returns the options that select and interpret scene files.
pub fn scene_options() -> Options {
    options(SceneArgs::augment_args(Command::new("")))
}

fn options(command: Command) -> Options {
    let named = command.get_arguments().filter_map(|arg| Some((arg.get_long()?, arg.get_action())));
    named.map(|(name, action)| (name.into(), Repetition(matches!(action, ArgAction::Append)))).collect()
}

/// Resolves flags of `blinn render` into what a session renders.
///
/// # Errors
/// A message for users.
pub fn parse_render(flags: Vec<OsString>) -> Result<SessionPlan, String> {
    let plan = render_flags::render_plan(flags, Path::new(LOADED_SCENE));
    plan.map(|plan| plan.session).map_err(|error| error.0)
}

/// Runs the program with the given arguments, its name first, inside a process of another program. Returns the exit
/// code.
pub fn run_program(arguments: Vec<OsString>) -> u8 {
    run_arguments(arguments, Host::Other)
}
