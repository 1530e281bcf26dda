//! Words about time, and about how the work is done.

use std::path::PathBuf;

use clap::Args;

use super::choices::*;
use crate::batch::{Chunk, FrameList};
use crate::cli::args::values;

/// The moment that is shown.
#[derive(Debug, Args)]
#[command(next_help_heading = "Time")]
pub struct MomentArgs {
    /// Moment of the animation
    #[arg(long, value_name = "SECONDS", value_parser = values::number, allow_hyphen_values = true)]
    pub time: Option<f64>,
    /// Animation by name or index, all, or none for the rest pose
    #[arg(long, value_name = "NAME|INDEX|all|none")]
    pub animation: Option<String>,
}

/// Moments by the number of their frame.
#[derive(Debug, Args)]
#[command(next_help_heading = "Time")]
pub struct TimeArgs {
    /// Moment by frame number: N/fps
    #[arg(long, value_name = "N", conflicts_with = "time", value_parser = values::number, allow_hyphen_values = true)]
    pub frame: Option<f64>,
    /// Renders an image of each frame: 1-240:2, 1-3,7,9-11, 10-1:-3 or 1..10; without LIST all of
    /// the clip, from 1. Past its end the last pose holds
    #[arg(long, value_name = "LIST", num_args = 0..=1, require_equals = true,
          conflicts_with_all = ["time", "frame"], value_parser = FrameList::parse)]
    pub frames: Option<Option<FrameList>>,
    /// Of those frames, the I-th of N shares
    #[arg(long, value_name = "I/N", requires = "frames", value_parser = Chunk::parse)]
    pub chunk: Option<Chunk>,
    /// Frames a second [default: 24]
    #[arg(long, value_parser = values::positive)]
    pub fps: Option<f64>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Process")]
pub struct ProcessArgs {
    /// Threads [default: the processors this process may use]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Refuses scenes that would take more memory than this, such as 4GiB or 800MB
    #[arg(long, value_name = "BYTES", value_parser = values::bytes)]
    pub max_memory: Option<u64>,
    #[command(flatten)]
    pub telling: TellArgs,
    /// Writes a page with all pictures, their times and warnings
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Takes settings from a file of flags by their names, such as size = "640x360"; the command
    /// line wins
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Prints all settings as such a file, and does nothing else
    #[arg(long)]
    pub print_config: bool,
    /// Prints the names of the files that would be written, and renders nothing
    #[arg(long)]
    pub dry_run: bool,
}

/// What is told on standard error.
#[derive(Debug, Args)]
#[command(next_help_heading = "Process")]
pub struct TellArgs {
    /// How progress is told on standard error
    #[arg(long, value_enum, default_value_t = ProgressArg::Auto)]
    pub progress: ProgressArg,
    /// Prints the time of each stage
    #[arg(long)]
    pub perf: bool,
    /// Says what was chosen: camera, lights, exposure
    #[arg(short, long)]
    pub verbose: bool,
}

/// What every command takes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Process")]
pub struct CommonArgs {
    /// Reads files outside the scene's folder too
    #[arg(long)]
    pub allow_outside: bool,
    /// Makes a warning an error
    #[arg(long)]
    pub strict: bool,
    /// Says nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
}
