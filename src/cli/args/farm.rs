//! The words of `blinn job`: an engine's, before the very words of what is rendered.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{ProcessArgs, RenderArgs, TurntableArgs};

#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub struct JobArgs {
    #[command(subcommand)]
    pub engine: EngineArgs,
}

/// What runs the tasks.
#[derive(Debug, Subcommand)]
pub enum EngineArgs {
    /// An Open Job Description template, 2023-09 with TASK_CHUNKING
    Openjd(OpenjdArgs),
    /// A script for Slurm's sbatch: an array of shares of the frames
    Slurm(SlurmArgs),
}

#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub struct OpenjdArgs {
    #[command(flatten)]
    pub job: JobFileArgs,
    /// Seconds that a task shall take: engines make more or fewer frames a task of it; 0 for as many as
    /// --chunk-size
    #[arg(long, value_name = "SECONDS", default_value_t = 300, value_parser = clap::value_parser!(u32).range(0..=604_800))]
    pub target_seconds: u32,
    #[command(subcommand)]
    pub frames: FramesArgs,
}

#[derive(Debug, Args)]
#[command(arg_required_else_help = true)]
pub struct SlurmArgs {
    #[command(flatten)]
    pub job: JobFileArgs,
    /// Tasks that run at one time, at most
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub at_once: u32,
    #[command(subcommand)]
    pub frames: FramesArgs,
}

/// Words about the job's file.
#[derive(Debug, Args)]
pub struct JobFileArgs {
    /// Writes the job to FILE, by whose folder its paths are then named [default: standard output, by
    /// the current folder]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Frames in a task [default: 10, or as many as leave a thousand tasks]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub chunk_size: Option<u32>,
}

/// Which frames.
#[derive(Debug, Subcommand)]
pub enum FramesArgs {
    /// Frames of a scene's animation: what blinn render takes, with --frames
    Render(Box<RenderArgs>),
    /// Frames of one turn around a scene: what blinn turntable takes
    Turntable(Box<TurntableArgs>),
}

impl EngineArgs {
    pub fn frames(&self) -> &FramesArgs {
        match self {
            EngineArgs::Openjd(args) => &args.frames,
            EngineArgs::Slurm(args) => &args.frames,
        }
    }

    pub fn job(&self) -> &JobFileArgs {
        match self {
            EngineArgs::Openjd(args) => &args.job,
            EngineArgs::Slurm(args) => &args.job,
        }
    }
}

impl FramesArgs {
    pub fn process(&self) -> &ProcessArgs {
        match self {
            FramesArgs::Render(args) => &args.process,
            FramesArgs::Turntable(args) => &args.process,
        }
    }
}
