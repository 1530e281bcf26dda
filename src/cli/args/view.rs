//! Arguments of `blinn view`.

use clap::Args;

use super::option_args::{OptionArgs, PictureGroup};
use super::preview::PreviewProcessArgs;
use super::process::CommonArgs;
use super::scene::SceneArgs;
use super::time::TimeArgs;

#[derive(Debug, Args)]
pub struct ViewArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub server: ServerArgs,
    #[command(flatten)]
    pub options: OptionArgs<PictureGroup>,
    #[command(flatten)]
    pub time: TimeArgs,
    #[command(flatten)]
    pub process: PreviewProcessArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

/// The address of the page.
#[derive(Debug, Args)]
#[command(next_help_heading = "Page")]
pub struct ServerArgs {
    /// Port on the loopback interface, for ssh -L [default: a free one]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub port: Option<u16>,
    /// Open the page in the browser
    #[arg(long)]
    pub open: bool,
    /// Print the address as JSON
    #[arg(long)]
    pub json: bool,
}
