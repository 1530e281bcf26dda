//! Options for how the work is done and reported.

use std::path::PathBuf;

use clap::Args;

use super::choices::{ColorArg, PathsArg, ProgressArg};
use super::option_args::{FileGroup, OptionArgs};
use super::values;

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Process")]
pub struct ProcessArgs {
    /// Number of threads [default: the processors available to this process]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Refuse scenes that need more memory, such as 4GiB or 800MB
    #[arg(long, value_name = "BYTES", value_parser = values::bytes)]
    pub max_memory: Option<u64>,
    /// Give up a scene after SECONDS: it fails, and the others go on
    ///
    /// Images that are finished by then are kept. Reading, building and rendering end between their steps.
    #[arg(long, value_name = "SECONDS", value_parser = values::positive)]
    pub timeout: Option<f64>,
    #[command(flatten)]
    pub log: LogArgs,
    /// Write an HTML page with all images, render times and warnings
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Write when each thread worked on which stage of which scene, for Perfetto and Chrome's trace viewer
    #[arg(long, value_name = "FILE.json")]
    pub trace: Option<PathBuf>,
    /// Append a line of JSON about each finished scene: done or failed, its error, warnings, seconds and bytes
    ///
    /// With --resume, scenes that it names as done are skipped without reading them, if their files and their images have
    /// the same sizes and times as before. Without --resume, it begins anew.
    #[arg(long, value_name = "FILE")]
    pub ledger: Option<PathBuf>,
    /// With --resume, skip scenes that --ledger names as failed
    #[arg(long, requires_all = ["ledger", "resume"])]
    pub no_retry: bool,
    /// Read options from a TOML file; the command line overrides them
    ///
    /// Keys are option names without dashes, such as size = "640x360".
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Print all options as a --config file and exit
    #[arg(long)]
    pub print_config: bool,
    /// Print the path of each written file on standard output: one a line, or each ended by a NUL for xargs -0 [default: lines]
    #[arg(long, value_enum, num_args = 0..=1, require_equals = true, default_missing_value = "lines")]
    pub print_paths: Option<PathsArg>,
    /// Print the names of the output files and exit
    #[arg(long)]
    pub dry_run: bool,
}

/// Messages on standard error.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Process")]
pub struct LogArgs {
    /// Format of progress messages on standard error
    #[arg(long, value_enum, default_value_t = ProgressArg::Auto)]
    pub progress: ProgressArg,
    /// Print the time of each stage
    #[arg(long)]
    pub perf: bool,
    /// Print the chosen camera, lights and exposure
    #[arg(short, long)]
    pub verbose: bool,
}

/// Options of all commands that read scenes.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Process")]
pub struct CommonArgs {
    #[command(flatten)]
    pub files: OptionArgs<FileGroup>,
    /// Treat warnings as errors
    #[arg(long)]
    pub strict: bool,
    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
    /// Colours of messages on standard error, and of help; auto: on a terminal, unless NO_COLOR is set. --kd is the colour of surfaces
    #[arg(long, value_enum, default_value_t = ColorArg::Auto)]
    pub color: ColorArg,
}

impl CommonArgs {
    /// True to allow files outside the scene's folder.
    pub fn allow_outside(&self) -> bool {
        self.files.given.contains("allow-outside")
    }
}
