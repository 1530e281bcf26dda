//! Arguments of `blinn diff`.

use std::path::PathBuf;

use clap::{Arg, ArgAction, Args};

use super::choices::UpArg;
use super::compare::CompareArgs;
use super::preview::PreviewArgs;
use super::scene::SceneArgs;
use super::values;

/// Options of NEW that differ from those of OLD.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "Scene")]
pub struct NewSceneArgs {
    /// Up axis of NEW, where it is not that of OLD [default: --up]
    #[arg(long, value_name = "UP")]
    pub new_up: Option<UpArg>,
    /// Factor of all lengths of NEW, where it is not that of OLD [default: --scale]
    #[arg(long, value_name = "FACTOR", value_parser = values::length_scale)]
    pub new_scale: Option<f64>,
}

#[derive(Debug, Args)]
#[command(mut_arg("scenes", two_files))]
pub struct DiffArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Write the pictures before and after and their differences: an HTML page, or one .png; of two folders, a page for each
    /// pair in FOLDER, or in a file with {stem}, {ext}, {parent} or {index} in its name
    #[arg(short, long, value_name = "FILE.html|FILE.png|FOLDER", help_heading = "Output")]
    pub output: Option<PathBuf>,
    /// Print JSON instead of text
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    /// Refuse to overwrite an existing file
    #[arg(long, help_heading = "Output")]
    pub no_overwrite: bool,
    #[command(flatten)]
    pub new: NewSceneArgs,
    #[command(flatten)]
    pub compare: CompareArgs,
    /// Largest distance of surfaces that counts as equal, in metres, or in the unit of files that do not name theirs, after
    /// --scale; pictures then count only with --tolerance or --flip [default: the precision of the coordinates]
    #[arg(long, value_name = "DISTANCE", value_parser = values::distance_tolerance, help_heading = "Comparison")]
    pub distance_tolerance: Option<f64>,
    /// Width and height of the pictures of scenes in pixels [default: 640x480, or the aspect ratio of the file's camera]
    #[arg(long, value_name = "WxH", value_parser = values::size, help_heading = "Image")]
    pub size: Option<(u32, u32)>,
    #[command(flatten)]
    pub preview: PreviewArgs,
}

/// Names the two files, which [`SceneArgs`] takes as scenes.
fn two_files(scenes: Arg) -> Arg {
    let help = "Two scenes (.gltf, .glb, .obj, .stl, .ply or .blend), two folders of them, or two images";
    scenes.action(ArgAction::Set).num_args(2).value_names(["OLD", "NEW"]).help(help).long_help(None)
}
