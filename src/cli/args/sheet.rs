//! Arguments of `blinn sheet`.

use std::path::PathBuf;

use clap::Args;

use super::choices::UpArg;
use super::preview::PreviewArgs;
use super::scene::SceneArgs;
use super::values::{self, SheetViews};
use blinn_session::FrameList;

#[derive(Debug, Args)]
pub struct SheetArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Output file, or a folder/ [default: {stem}_sheet.png]
    ///
    /// The extension selects the format: .png, .jpg or .webp. {stem}, {ext}, {parent} and {index} stand for the scene's name,
    /// extension, folder and number. One file for several scenes is a contact sheet: a picture of each, isometric or the first of
    /// --views, with the name of its file; further pages are OUT-2.png and so on.
    #[arg(short, long, value_name = "OUT", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Print JSON: the camera of each view and its mapping from the model to pixels
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Refuse to overwrite existing files
    #[arg(long, help_heading = "Output")]
    pub no_overwrite: bool,
    /// Width and height of the sheet in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x960", value_parser = values::size, help_heading = "Image")]
    pub size: (u32, u32),
    /// Show these views with their names, a list: front, right, back, left, top, bottom, isometric, degrees (30, 30/20),
    /// turntable=N, or cameras, those of the file [default: a drawing of four views with dimensions]
    ///
    /// Degrees are from the front (+Z) to the right, and above the horizon. Directions are orthographic, at one scale.
    #[arg(long, value_name = "LIST", value_parser = values::sheet_views, conflicts_with = "cameras", help_heading = "Camera",
          allow_hyphen_values = true)]
    pub views: Option<SheetViews>,
    /// Show the cameras of a list with their names: transforms.json, the folder of a COLMAP model, BOP's scene_camera.json, or
    /// JSON lines
    #[arg(long, value_name = "FILE|FOLDER", help_heading = "Camera")]
    pub cameras: Option<PathBuf>,
    /// Up axis of the world of --cameras [default: y]
    #[arg(long, value_enum, requires = "cameras", help_heading = "Camera")]
    pub world_up: Option<UpArg>,
    /// Show only these cameras of --cameras: 1-36:2, 1-3,7,9-11
    #[arg(long, value_name = "LIST", requires = "cameras", value_parser = FrameList::parse, help_heading = "Camera")]
    pub only: Option<FrameList>,
    #[command(flatten)]
    pub preview: PreviewArgs,
}
