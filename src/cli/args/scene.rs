//! Options that select and interpret scene files.

use std::path::PathBuf;

use clap::Args;

use super::choices::{FormatArg, GlassArg, UpArg};
use super::values;
use blinn_import::NormalMode;

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Scene")]
pub struct SceneArgs {
    /// Scenes, folders or .tar files of them, or @LIST; - for standard input
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// Format of the scene files, which is otherwise detected
    #[arg(long, value_enum)]
    pub format: Option<FormatArg>,
    /// Scene within the file, by name or index
    #[arg(long, value_name = "NAME|INDEX")]
    pub scene: Option<String>,
    /// Material variant of a glTF file, by name; none for the default materials
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Up axis of the file
    #[arg(long, value_enum, default_value_t = UpArg::Y)]
    pub up: UpArg,
    /// Transmissive meshes: thin walls, solid bodies that refract, or auto to decide by volumes, exporter and closed
    /// surfaces
    #[arg(long, value_enum, default_value_t = GlassArg::Auto)]
    pub glass: GlassArg,
    /// Recompute normals: smooth across edges below ANGLE degrees, or flat (off) [default: the file's normals]
    #[arg(long, value_name = "ANGLE|off", value_parser = values::smooth)]
    pub smooth: Option<NormalMode>,
}
