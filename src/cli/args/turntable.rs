//! Arguments of `blinn turntable`.

use clap::Args;
use glam::DVec3;

use super::choices::{DirectionArg, EaseArg, TurnArg, UpArg};
use super::option_args::{OptionArgs, PictureGroup};
use super::output::OutputArgs;
use super::process::{CommonArgs, ProcessArgs};
use super::scene::SceneArgs;
use super::time::TimeArgs;
use super::values::{self, CategoryRule, DatasetFormats};
use super::view_sampling::ViewSamplingArgs;
use blinn_session::{Chunk, FrameList};

#[derive(Debug, Args)]
pub struct TurntableArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub output: OutputArgs,
    #[command(flatten)]
    pub turn: TurnArgs,
    #[command(flatten)]
    pub options: OptionArgs<PictureGroup>,
    #[command(flatten)]
    pub time: TimeArgs,
    #[command(flatten)]
    pub process: ProcessArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

/// The rotation of a turntable.
#[derive(Debug, Args)]
#[command(next_help_heading = "Turntable")]
pub struct TurnArgs {
    /// Number of frames in one turn; the first is not repeated at the end
    #[arg(long, alias = "frames", value_name = "N", default_value_t = 36,
          value_parser = values::frame_count)]
    pub count: u32,
    /// Render only these frames, which keep their numbers: 1-36:2, 1-3,7,9-11
    #[arg(long, value_name = "LIST", value_parser = FrameList::parse)]
    pub only: Option<FrameList>,
    /// Render only the I-th of N equal parts: of the scenes if there are several, else of the frames
    ///
    /// Several files, a list or a folder are several scenes.
    #[arg(long, value_name = "I/N", value_parser = Chunk::parse)]
    pub chunk: Option<Chunk>,
    /// Rotate the model in front of a fixed camera and lights, or the camera
    #[arg(long, value_enum, default_value_t = TurnArg::Model)]
    pub turn: TurnArg,
    /// Rotation axis through the centre of the scene's bounds: x, y, z or a direction [default: y]
    #[arg(long, value_name = "X,Y,Z", value_parser = values::axis)]
    pub axis: Option<DVec3>,
    /// Rotation angle of the first frame
    #[arg(long, value_name = "DEGREES", default_value = "0", value_parser = values::angle)]
    pub start: f64,
    /// Counter-clockwise as seen from the tip of the axis (from above), or clockwise
    #[arg(long, value_enum, default_value_t = DirectionArg::Ccw)]
    pub direction: DirectionArg,
    /// Camera elevation above the horizon, framing the scene [default: the file's camera, else 22]
    #[arg(long, value_name = "DEGREES", value_parser = values::elevation,
          conflicts_with_all = ["orbit", "view-point", "view-dir", "camera-xml"])]
    pub elevation: Option<f64>,
    /// Ease the rotation in and out
    #[arg(long, value_enum, default_value_t = EaseArg::None)]
    pub ease: EaseArg,
    /// Render a dataset instead: N views around the scene, with transforms.json
    ///
    /// Each view has depth, normal and mask images. Lights stay fixed. --camera selects the lens, --look-at the
    /// centre, --on the distribution.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000),
          conflicts_with_all = ["count", "turn", "axis", "start", "direction", "elevation", "ease", "orbit",
                                "view-point", "view-dir", "view-up", "camera-xml", "camera-azimuth-angle",
                                "camera-elevation-angle"])]
    pub views: Option<u32>,
    /// Formats of the dataset, a list: nerf (transforms.json), colmap or colmap-bin (a sparse model as text or binary), bop
    /// (object poses), coco or coco-polygons (annotations.json) [default: nerf]
    #[arg(long, value_name = "LIST", value_parser = values::dataset_formats)]
    pub dataset: Option<DatasetFormats>,
    /// Categories of --dataset coco: object, material, scene or folder (their names), NAME=GLOB, NAME=material:GLOB or
    /// NAME=scene:GLOB (repeatable) [default: object]
    ///
    /// folder is that of the scene's file. GLOB matches object names and paths, as in --hide, names of materials, or names of
    /// scenes and with a slash their paths below the folder of all. The first rule that applies decides; objects without category
    /// are not annotated.
    #[arg(long, value_name = "RULE", requires = "dataset", value_parser = values::category_rule)]
    pub category: Vec<CategoryRule>,
    /// Write one dataset of all scenes: one annotations.json, BOP's scenes with common models, COLMAP's models below one folder
    ///
    /// -o names a folder. Scenes that failed are left out until --resume renders them.
    #[arg(long, requires = "dataset")]
    pub merge: bool,
    /// Give objects that have the same mesh in several scenes one model of BOP, with --merge or in archives
    ///
    /// Numbers of objects follow from the content of models. Objects must be as large, but may be turned and moved.
    #[arg(long, requires = "dataset")]
    pub share_models: bool,
    #[command(flatten)]
    pub sampling: ViewSamplingArgs,
    /// Up axis of the world in transforms.json [default: z, as NeRF tools expect]
    #[arg(long, value_enum)]
    pub world_up: Option<UpArg>,
    /// Frames per second of an animation [default: 24]
    #[arg(long, value_parser = values::positive)]
    pub fps: Option<f64>,
}
