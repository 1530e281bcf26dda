//! Arguments of `blinn sheet`.

use std::path::PathBuf;

use clap::Args;

use super::preview::PreviewArgs;
use super::scene::SceneArgs;
use super::values;

#[derive(Debug, Args)]
pub struct SheetArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Output file, or a folder/ [default: {stem}_sheet.png]
    ///
    /// The extension selects the format: .png, .jpg or .webp. {stem}, {parent} and {index} stand for the scene's name,
    /// folder and number.
    #[arg(short, long, value_name = "OUT", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Print JSON: the camera of each view and its mapping from the model to pixels
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Refuse to overwrite existing files
    #[arg(long, help_heading = "Output")]
    pub no_overwrite: bool,
    /// Width and height of the sheet in pixels; each view has a quarter
    #[arg(long, value_name = "WxH", default_value = "1280x960", value_parser = values::size, help_heading = "Image")]
    pub size: (u32, u32),
    #[command(flatten)]
    pub preview: PreviewArgs,
}
