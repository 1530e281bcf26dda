//! Options of commands that show scenes from fixed views: `sheet` and `diff`.

use clap::Args;

use super::option_args::{OptionArgs, PreviewGroup, named_options};
use super::process::{CommonArgs, LogArgs};
use super::scene::SceneArgs;
use super::time::TimeArgs;
use super::values;
use crate::usage::UsageError;
use blinn_core::geometry::Rgb;
use blinn_render::display::Background;
use blinn_session::{ImageBackground, Options};

/// Options of views that have cameras of their own.
#[derive(Clone, Debug, Args)]
pub struct PreviewArgs {
    #[command(flatten)]
    pub options: OptionArgs<PreviewGroup>,
    #[command(flatten)]
    pub time: TimeArgs,
    #[command(flatten)]
    pub process: PreviewProcessArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Process")]
pub struct PreviewProcessArgs {
    /// Number of threads [default: the processors available to this process]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Refuse scenes that need more memory, such as 4GiB or 800MB
    #[arg(long, value_name = "BYTES", value_parser = values::bytes)]
    pub max_memory: Option<u64>,
    #[command(flatten)]
    pub log: LogArgs,
}

impl PreviewArgs {
    /// The options of images of `size` pixels, but for the camera. `background` is that without --background.
    ///
    /// # Errors
    /// Options that cannot be combined.
    pub fn options(
        &self,
        scene: &SceneArgs,
        size: (u32, u32),
        background: Rgb,
    ) -> Result<Options, UsageError> {
        let animation = &self.time.animation;
        let groups = [&scene.options.given, &self.options.given, &animation.given, &self.common.files.given];
        let options = named_options(groups)?.finish()?;
        let background = ImageBackground::Fixed(Background::Color(background));
        Ok(Options {
            size: Some(size),
            background: Some(options.background.unwrap_or(background)),
            ..options
        })
    }
}
