//! Arguments of `blinn assemble`.

use std::path::PathBuf;

use clap::Args;

use super::choices::{DirectionArg, LoopArg};
use super::process::LogArgs;
use super::values;
use blinn_render::display::Background;

#[derive(Debug, Args)]
pub struct AssembleArgs {
    /// PNG, JPEG or WebP files of one size, or a folder with one sequence
    ///
    /// They are sorted by their numbers.
    #[arg(required = true, value_name = "FRAMES")]
    pub frames: Vec<PathBuf>,
    /// Output file: .gif, .apng, .webp, .mp4 or .html
    #[arg(short, long, value_name = "OUT", help_heading = "Output")]
    pub output: PathBuf,
    /// Frames per second
    #[arg(long, default_value_t = 24.0, value_parser = values::positive, help_heading = "Time")]
    pub fps: f64,
    /// Repeat the animation or play it once (for .mp4, the player decides)
    #[arg(long, value_enum, default_value_t = LoopArg::Forever, help_heading = "Time")]
    pub r#loop: LoopArg,
    /// Quality of .webp (100 is lossless), .mp4 and .html, from 1 to 100 [default: 90]
    #[arg(long, value_name = "Q", value_parser = clap::value_parser!(u8).range(1..=100), help_heading = "Output")]
    pub encoder_quality: Option<u8>,
    /// Direction in which the frames turn, seen from above; dragging in an .html follows it [default: ccw]
    #[arg(long, value_enum, help_heading = "Turntable")]
    pub direction: Option<DirectionArg>,
    /// Background colour of transparent frames [default: transparent]
    #[arg(long, value_name = "COLOR|transparent", value_parser = values::background, help_heading = "Image")]
    pub background: Option<Background>,
    /// Refuse to overwrite existing files
    #[arg(long, help_heading = "Output")]
    pub no_overwrite: bool,
    /// Treat a missing frame as an error
    #[arg(long, help_heading = "Process")]
    pub strict: bool,
    #[command(flatten)]
    pub log: LogArgs,
    /// Print errors only
    #[arg(short, long, help_heading = "Process")]
    pub quiet: bool,
}
