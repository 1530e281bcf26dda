//! Options of commands that show scenes from fixed views: `sheet` and `diff`.

use clap::{Args, Command, Error, FromArgMatches};

use super::choices::ViewArg;
use super::process::{CommonArgs, LogArgs};
use super::render::RenderArgs;
use super::render_options::{LightArgs, ShadingArgs};
use super::scene::SceneArgs;
use super::time::TimeArgs;
use super::values;
use super::values::BackgroundArg;
use blinn_session::Exposure;

/// Options of views that have cameras of their own.
#[derive(Clone, Debug, Args)]
pub struct PreviewArgs {
    #[command(flatten)]
    pub image: PreviewImageArgs,
    #[command(flatten)]
    pub light: LightArgs,
    #[command(flatten)]
    pub shading: ShadingArgs,
    #[command(flatten)]
    pub time: TimeArgs,
    #[command(flatten)]
    pub process: PreviewProcessArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Image")]
pub struct PreviewImageArgs {
    /// Samples per pixel; a single sample is at the pixel's centre
    #[arg(short, long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub samples: u32,
    /// Background: a colour as displayed, none (transparent), or the environment of --hdri or the file (hdri)
    #[arg(long, value_name = "COLOR|transparent|hdri", value_parser = values::image_background)]
    pub background: Option<BackgroundArg>,
    /// Exposure in stops (EV), or auto to meter the scene
    #[arg(long, value_name = "auto|EV", value_parser = values::exposure)]
    pub exposure: Option<Exposure>,
    /// View transform from linear light to display colours; auto is agx for Blender's glTF files, else standard
    #[arg(long, value_enum, default_value_t = ViewArg::Auto)]
    pub view: ViewArg,
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
    /// The arguments of `blinn render` that render the same images, but for the camera and the output. `background` is
    /// that without --background.
    ///
    /// # Errors
    /// The arguments have no defaults.
    pub fn to_render_args(
        &self,
        scene: SceneArgs,
        size: (u32, u32),
        background: BackgroundArg,
    ) -> Result<RenderArgs, Error> {
        let mut render = render_defaults()?;
        let PreviewImageArgs { samples, background: given, exposure, view } = self.image.clone();
        render.scene = scene;
        render.options.image.size = Some(size);
        render.options.image.samples = samples;
        render.options.image.background = Some(given.unwrap_or(background));
        render.options.image.exposure = exposure;
        render.options.image.view = view;
        render.options.light = self.light.clone();
        render.options.shading = self.shading.clone();
        render.time = self.time.clone();
        render.process.threads = self.process.threads;
        render.process.max_memory = self.process.max_memory;
        render.process.log = self.process.log.clone();
        render.common = self.common.clone();
        Ok(render)
    }
}

/// The arguments of `blinn render` without any option.
fn render_defaults() -> Result<RenderArgs, Error> {
    let command = RenderArgs::augment_args(Command::new("render")).no_binary_name(true);
    RenderArgs::from_arg_matches(&command.try_get_matches_from(["scene"])?)
}
