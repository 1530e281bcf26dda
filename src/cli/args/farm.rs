//! Arguments of `blinn job`: those of the farm's engine, followed by a complete render or turntable command.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::command_args::{CommandArgs, CommandGroup};
use super::option_args::GivenOptions;
use super::output::OutputArgs;
use super::process::{CommonArgs, ProcessArgs};
use super::render::RenderArgs;
use super::turntable::TurntableArgs;

#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub struct JobArgs {
    #[command(subcommand)]
    pub engine: EngineArgs,
}

/// The scheduler that runs the tasks.
#[derive(Debug, Subcommand)]
pub enum EngineArgs {
    /// Print an Open Job Description template, 2023-09 with TASK_CHUNKING
    Openjd(CommandGroup<OpenjdArgs>),
    /// Print an sbatch script for Slurm that runs an array job
    Slurm(CommandGroup<SlurmArgs>),
}

#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub struct OpenjdArgs {
    #[command(flatten)]
    pub job: JobFileArgs,
    /// Target run time of a task; the engine adapts the frames per task to it, 0 keeps --chunk-size
    #[arg(long, value_name = "SECONDS", default_value_t = 300, value_parser = clap::value_parser!(u32).range(0..=604_800))]
    pub target_seconds: u32,
    #[command(subcommand)]
    pub command: JobCommand,
}

#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub struct SlurmArgs {
    #[command(flatten)]
    pub job: JobFileArgs,
    /// Maximum number of tasks that run at the same time
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub at_once: u32,
    #[command(subcommand)]
    pub command: JobCommand,
}

/// Options for the job description.
#[derive(Debug, Args)]
pub struct JobFileArgs {
    /// Write the job to FILE; its paths are relative to FILE's folder [default: standard output, paths relative to
    /// the current folder]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Frames per task [default: 10, or as many as give 1000 tasks]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub chunk_size: Option<u32>,
}

/// The command that the tasks run.
#[derive(Debug, Subcommand)]
pub enum JobCommand {
    /// Render frames of an animation: the options of blinn render
    Render(CommandArgs<RenderArgs>),
    /// Render frames of a turntable: the options of blinn turntable
    Turntable(CommandArgs<TurntableArgs>),
}

impl EngineArgs {
    pub fn command(&self) -> &JobCommand {
        match self {
            EngineArgs::Openjd(args) => &args.command,
            EngineArgs::Slurm(args) => &args.command,
        }
    }

    pub fn job(&self) -> &JobFileArgs {
        match self {
            EngineArgs::Openjd(args) => &args.job,
            EngineArgs::Slurm(args) => &args.job,
        }
    }
}

impl JobCommand {
    pub fn output(&self) -> &OutputArgs {
        match self {
            JobCommand::Render(args) => &args.output,
            JobCommand::Turntable(args) => &args.output,
        }
    }

    /// The options of pictures.
    pub fn options(&self) -> &GivenOptions {
        match self {
            JobCommand::Render(args) => &args.options.given,
            JobCommand::Turntable(args) => &args.options.given,
        }
    }

    pub fn process(&self) -> &ProcessArgs {
        match self {
            JobCommand::Render(args) => &args.process,
            JobCommand::Turntable(args) => &args.process,
        }
    }

    pub fn common(&self) -> &CommonArgs {
        match self {
            JobCommand::Render(args) => &args.common,
            JobCommand::Turntable(args) => &args.common,
        }
    }
}
