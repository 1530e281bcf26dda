//! Arguments of `blinn info`.

use clap::Args;

use super::process::CommonArgs;
use super::scene::SceneArgs;

#[derive(Debug, Args)]
pub struct InfoArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Print JSON: an object, or a list of objects for several scenes
    ///
    /// A scene that fails has the keys "file" and "error".
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    #[command(flatten)]
    pub common: CommonArgs,
}
