//! The program and its commands.

use clap::{Parser, Subcommand};

use super::assemble::AssembleArgs;
use super::bench::BenchArgs;
use super::command_args::{CommandArgs, CommandGroup};
use super::diff::DiffArgs;
use super::farm::JobArgs;
use super::info::InfoArgs;
use super::packaging::{CompletionsArgs, ManArgs};
use super::process::ProcessArgs;
use super::rays::RaysArgs;
use super::render::RenderArgs;
use super::sheet::SheetArgs;
use super::turntable::TurntableArgs;
use super::view::ViewArgs;

/// Render glTF, OBJ, STL and PLY scenes on the CPU
#[derive(Debug, Parser)]
#[command(name = "blinn", version, max_term_width = 100, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render an image of each scene
    Render(CommandArgs<RenderArgs>),
    /// Render a turntable of each scene: one turn, seen from all sides
    Turntable(CommandArgs<TurntableArgs>),
    /// Show a scene in the browser: find a camera, and copy its command
    View(CommandArgs<ViewArgs>),
    /// Draw views from four sides at one scale, with dimensions
    Sheet(CommandArgs<SheetArgs>),
    /// Compare two scenes, two images, or two folders of scenes
    Diff(CommandArgs<DiffArgs>),
    /// Make an animation from finished frames
    Assemble(CommandArgs<AssembleArgs>),
    /// Print the contents of a scene
    Info(CommandArgs<InfoArgs>),
    /// Measure load, build, ray and frame times and memory
    Bench(CommandArgs<BenchArgs>),
    /// Write the rays of a benchmark and their hits for NumPy
    Rays(CommandArgs<RaysArgs>),
    /// Print completions for a shell
    Completions(CommandArgs<CompletionsArgs>),
    /// Print a man page
    Man(CommandArgs<ManArgs>),
    /// Print a job description for a render farm
    Job(CommandGroup<JobArgs>),
}

impl Command {
    /// Process options of the commands that render.
    pub fn process(&self) -> Option<&ProcessArgs> {
        match self {
            Command::Render(args) => Some(&args.process),
            Command::Turntable(args) => Some(&args.process),
            Command::Job(args) => Some(args.engine.command().process()),
            _ => None,
        }
    }
}
