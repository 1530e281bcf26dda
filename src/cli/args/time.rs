//! Options that select times and frames of an animation.

use clap::Args;

use super::option_args::{AnimationGroup, OptionArgs};
use super::values;
use blinn_session::{Chunk, FrameList};

/// A time in an animation.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Time")]
pub struct TimeArgs {
    /// Time in the animation
    #[arg(long, value_name = "SECONDS", value_parser = values::number)]
    pub time: Option<f64>,
    #[command(flatten)]
    pub animation: OptionArgs<AnimationGroup>,
}

/// Times as frame numbers.
#[derive(Debug, Args)]
#[command(next_help_heading = "Time")]
pub struct FrameArgs {
    /// Time as a frame number: N divided by --fps
    #[arg(long, value_name = "N", conflicts_with = "time", value_parser = values::number)]
    pub frame: Option<f64>,
    /// Render these frames: 1-240:2, 1-3,7,9-11, 10-1:-3 or 1..10 [default LIST: the whole clip, from 1]
    ///
    /// The last pose holds after the end of the clip.
    #[arg(long, value_name = "LIST", num_args = 0..=1, require_equals = true,
          conflicts_with_all = ["time", "frame"], value_parser = FrameList::parse)]
    pub frames: Option<Option<FrameList>>,
    /// Render only the I-th of N equal parts: of the scenes if there are several, else of --frames or --cameras
    ///
    /// Several files, a list or a folder are several scenes.
    #[arg(long, value_name = "I/N", value_parser = Chunk::parse)]
    pub chunk: Option<Chunk>,
    /// Frames per second [default: 24]
    #[arg(long, value_parser = values::positive)]
    pub fps: Option<f64>,
}
