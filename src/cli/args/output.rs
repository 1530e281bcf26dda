//! Options for output files.

use std::path::PathBuf;

use clap::Args;

use super::choices::LoopArg;
use super::values::{self, ShardSize};

#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Output")]
pub struct OutputArgs {
    /// Output file, a folder/, or - for a PNG on standard output [default: {stem}.png, {stem}_####.png]
    ///
    /// A name without an extension is a folder, too, if there are several images.
    ///
    /// The extension selects the format: .png, .exr, .jpg or .webp for an image of each frame; .gif, .apng, .mp4 or
    /// .html for one animation of all frames. {stem}, {ext}, {parent} and {index} stand for the scene's name, extension, folder and
    /// number ({index:05} with zeros), #### (also %04d or {frame:04}) for the frame number. It is appended if several frames go to a name
    /// without it. For an animated .webp, render frames and use blinn assemble.
    #[arg(short, long, value_name = "OUT")]
    pub output: Option<PathBuf>,
    /// Most images, or bytes, in each archive of -o NAME{shard:05}.tar: 1000, 512MB; archives hold whole scenes [default:
    /// 1000]
    ///
    /// Each image has its layers and a .json beside it, as WebDataset reads them. NAME{shard:05}.jpg.tar holds JPEG. Samples of
    /// --dataset bop are named as BOP's tools read them, with models beside the archives.
    #[arg(long, value_name = "N|BYTES", value_parser = values::shard_size)]
    pub shard_size: Option<ShardSize>,
    /// Bits per channel: 8 or 16 for PNG, 16 or 32 for EXR
    #[arg(long, value_parser = ["8", "16", "32"])]
    pub depth: Option<String>,
    /// Quality of .jpg, .mp4 and .html, from 1 to 100 [default: 90]
    #[arg(long, value_name = "Q", value_parser = clap::value_parser!(u8).range(1..=100))]
    pub encoder_quality: Option<u8>,
    /// Repeat the animation or play it once (for .mp4, the player decides) [default: forever]
    #[arg(long, value_enum)]
    pub r#loop: Option<LoopArg>,
    /// Keep images that are up to date and render the missing ones
    ///
    /// An image is up to date if the same version made it from the same files with the same options. With --strict,
    /// it must have been made with --strict.
    #[arg(long, conflicts_with = "no_overwrite")]
    pub resume: bool,
    /// Refuse to overwrite existing files
    #[arg(long)]
    pub no_overwrite: bool,
}
