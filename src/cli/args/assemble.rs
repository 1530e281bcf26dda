//! The words of `blinn assemble`.

use std::path::PathBuf;

use clap::Args;

use super::{DirectionArg, LoopArg, TellArgs};
use crate::cli::args::values;
use crate::display::Background;

#[derive(Debug, Args)]
pub struct AssembleArgs {
    /// PNG, JPEG or WebP files of one size, or folders that hold one series of them; they come in the
    /// order of their numbers
    #[arg(required = true, value_name = "FRAMES")]
    pub frames: Vec<PathBuf>,
    /// Output: a .gif, .apng, .webp, .mp4 or .html
    #[arg(short, long, value_name = "OUT", help_heading = "Output")]
    pub output: PathBuf,
    /// Frames a second
    #[arg(long, default_value_t = 24.0, value_parser = values::positive, help_heading = "Time")]
    pub fps: f64,
    /// Whether it starts over at its end (an .mp4 leaves that to its player)
    #[arg(long, value_enum, default_value_t = LoopArg::Forever, help_heading = "Time")]
    pub r#loop: LoopArg,
    /// Quality, 1 to 100, of .webp (100: without loss), .mp4 and .html [default: 90]
    #[arg(long, value_name = "Q", value_parser = clap::value_parser!(u8).range(1..=100), help_heading = "Output")]
    pub quality: Option<u8>,
    /// Which way what the frames show turns, as seen from above: drags on an .html take it along [default: ccw]
    #[arg(long, value_enum, help_heading = "Turntable")]
    pub direction: Option<DirectionArg>,
    /// What is behind frames that are transparent [default: what is behind the picture]
    #[arg(long, value_name = "COLOR|transparent", value_parser = values::background, help_heading = "Image")]
    pub background: Option<Background>,
    /// Refuses to replace a file
    #[arg(long, help_heading = "Output")]
    pub no_overwrite: bool,
    /// Makes a missing frame an error
    #[arg(long, help_heading = "Process")]
    pub strict: bool,
    #[command(flatten)]
    pub telling: TellArgs,
    /// Says nothing but errors
    #[arg(short, long, help_heading = "Process")]
    pub quiet: bool,
}
