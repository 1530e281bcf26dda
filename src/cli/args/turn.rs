//! Words about turntables.

use clap::Args;
use glam::DVec3;

use super::choices::*;
use crate::batch::{Chunk, FrameList};
use crate::cli::args::values;

#[derive(Debug, Args)]
#[command(next_help_heading = "Turntable")]
pub struct TurnArgs {
    /// Frames once around; the first is not repeated at the end
    #[arg(long, alias = "frames", value_name = "N", default_value_t = 36,
          value_parser = values::frame_count)]
    pub count: u32,
    /// Renders just these frames, which keep their numbers: 1-36:2, 1-3,7,9-11
    #[arg(long, value_name = "LIST", value_parser = FrameList::parse)]
    pub only: Option<FrameList>,
    /// Of those frames, the I-th of N shares
    #[arg(long, value_name = "I/N", value_parser = Chunk::parse)]
    pub chunk: Option<Chunk>,
    /// What turns: the model, while camera and lights stand still, or the camera
    #[arg(long, value_enum, default_value_t = TurnArg::Model)]
    pub turn: TurnArg,
    /// The axis, through the middle of the scene's bounds: x, y, z or a direction [default: y]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::axis, allow_hyphen_values = true)]
    pub axis: Option<DVec3>,
    /// Where the first frame stands
    #[arg(long, value_name = "DEGREES", default_value = "0", value_parser = values::angle, allow_hyphen_values = true)]
    pub start: f64,
    /// Counter-clockwise as seen from the axis's tip (from above), or clockwise
    #[arg(long, value_enum, default_value_t = DirectionArg::Ccw)]
    pub direction: DirectionArg,
    /// How high above the horizon the camera stands, as far away as it takes to see everything
    /// [default: the file's camera, else 22]
    #[arg(long, value_name = "DEGREES", value_parser = values::elevation, allow_hyphen_values = true,
          conflicts_with_all = ["orbit", "view_point", "view_dir", "camera_xml"])]
    pub elevation: Option<f64>,
    /// Whether it starts and ends gently
    #[arg(long, value_enum, default_value_t = EaseArg::None)]
    pub ease: EaseArg,
    /// Instead of a turn a dataset: N views from all around, evenly, with depth, normal and mask
    /// beside each, and transforms.json that says where from. Lights stand still; --camera lends its
    /// lens, --look-at is the middle
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000),
          conflicts_with_all = ["count", "turn", "axis", "start", "direction", "elevation", "ease", "orbit",
                                "view_point", "view_dir", "view_up", "camera_xml", "camera_azimuth_angle",
                                "camera_elevation_angle"])]
    pub views: Option<u32>,
    /// Which way is up in transforms.json [default: z, as the tools expect]
    #[arg(long, value_enum, requires = "views")]
    pub nerf_up: Option<UpArg>,
    /// Frames a second of a moving picture [default: 24]
    #[arg(long, value_parser = values::positive)]
    pub fps: Option<f64>,
}
