//! Options that select and interpret scene files.

use std::path::PathBuf;

use clap::Args;

use super::option_args::{OptionArgs, SceneGroup};

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Scene")]
pub struct SceneArgs {
    /// Scenes, folders or .tar files of them, or @LIST; - for standard input
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    #[command(flatten)]
    pub options: OptionArgs<SceneGroup>,
}
