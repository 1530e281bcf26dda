//! Arguments of `blinn render`.

use clap::Args;

use super::camera_list::CameraListArgs;
use super::check::CheckArgs;
use super::option_args::{OptionArgs, PictureGroup};
use super::output::OutputArgs;
use super::process::{CommonArgs, ProcessArgs};
use super::scene::SceneArgs;
use super::time::{FrameArgs, TimeArgs};

#[derive(Debug, Args)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub output: OutputArgs,
    #[command(flatten)]
    pub options: OptionArgs<PictureGroup>,
    #[command(flatten)]
    pub cameras: CameraListArgs,
    #[command(flatten)]
    pub frames: FrameArgs,
    #[command(flatten)]
    pub time: TimeArgs,
    #[command(flatten)]
    pub check: CheckArgs,
    /// Render again whenever the scene or a file that it uses changes, until Ctrl-C
    #[arg(long, help_heading = "Process",
          conflicts_with_all = ["resume", "no_overwrite", "chunk", "ledger", "report", "trace", "dry_run", "bless"])]
    pub watch: bool,
    #[command(flatten)]
    pub process: ProcessArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}
