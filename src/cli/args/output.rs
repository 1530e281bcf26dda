//! Words about the files that are written.

use std::path::PathBuf;

use clap::Args;

use super::LoopArg;

#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub struct OutputArgs {
    /// Output: a .png, .exr, .jpg or .webp for each picture; a .gif, .apng, .mp4 or .html of all
    /// frames; a folder/; or - for a PNG on standard output. {stem}, {parent} and {index} stand for
    /// the scene, #### (or %04d, {frame:04}) for the frame, which is added where several frames go to
    /// a name without (a moving .webp is blinn assemble's) [default: {stem}.png, {stem}_####.png]
    #[arg(short, long, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Bits a channel: 8 or 16 in PNG, 16 or 32 in EXR
    #[arg(long, value_parser = ["8", "16", "32"])]
    pub depth: Option<String>,
    /// Quality of a .jpg, .mp4 or .html, 1 to 100 [default: 90]
    #[arg(long, value_name = "Q", value_parser = clap::value_parser!(u8).range(1..=100))]
    pub quality: Option<u8>,
    /// Whether a moving picture starts over at its end (an .mp4 leaves that to its player) [default:
    /// forever]
    #[arg(long, value_enum)]
    pub r#loop: Option<LoopArg>,
    /// Keeps pictures that were made by the same version from the same files with the same
    /// settings, and makes what is missing; with --strict, keeps what was made with it
    #[arg(long, conflicts_with = "no_overwrite")]
    pub resume: bool,
    /// Refuses to replace a file
    #[arg(long)]
    pub no_overwrite: bool,
}
