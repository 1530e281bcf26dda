//! The raw words of the command line.

pub(crate) mod argv;
mod assemble;
mod bench;
mod choices;
pub(crate) mod config;
mod farm;
pub(crate) mod foreign_flags;
pub(crate) mod help;
mod output;
mod packaging;
mod process;
mod render_options;
mod turn;
pub(crate) mod usage_error;
pub(crate) mod values;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::import::NormalMode;

pub use assemble::AssembleArgs;
pub use bench::BenchArgs;
pub use choices::*;
pub use farm::{EngineArgs, FramesArgs, JobArgs};
pub use output::OutputArgs;
pub use packaging::{CompletionsArgs, ManArgs};
pub use process::{CommonArgs, MomentArgs, ProcessArgs, TellArgs, TimeArgs};
pub use render_options::{CameraArgs, ImageArgs, LightArgs, ShadingArgs};
pub use turn::TurnArgs;

/// Renders glTF and OBJ mesh scenes on the CPU.
#[derive(Debug, Parser)]
#[command(name = "blinn", version, max_term_width = 100, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Renders an image of each scene
    Render(Box<RenderArgs>),
    /// Renders each scene from all around, as frames of one turn
    Turntable(Box<TurntableArgs>),
    /// Makes a moving picture of finished frames
    Assemble(AssembleArgs),
    /// Says what is in a scene
    Info(InfoArgs),
    /// Measures reading, trees, rays, frames and memory
    Bench(Box<BenchArgs>),
    /// Prints completions for a shell
    Completions(CompletionsArgs),
    /// Prints a page for man
    Man(ManArgs),
    /// Describes frames as a job for a farm
    Job(JobArgs),
}

impl Command {
    /// How the work is done, for commands that render.
    pub fn process(&self) -> Option<&ProcessArgs> {
        match self {
            Command::Render(args) => Some(&args.process),
            Command::Turntable(args) => Some(&args.process),
            Command::Job(args) => Some(args.engine.frames().process()),
            _ => None,
        }
    }
}

/// A scene file and how it is read.
#[derive(Debug, Args)]
#[command(next_help_heading = "Scene")]
pub struct SceneArgs {
    /// Scene files: .gltf, .glb or .obj
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// Scene of the file, by name or index
    #[arg(long, value_name = "NAME|INDEX")]
    pub scene: Option<String>,
    /// Material variant of a glTF file, by name; none for its default materials
    #[arg(long, value_name = "NAME")]
    pub variant: Option<String>,
    /// Which way is up in the file
    #[arg(long, value_enum, default_value_t = UpArg::Y)]
    pub up: UpArg,
    /// New normals, smooth across edges of less than ANGLE degrees, or none [default: the file's]
    #[arg(long, value_name = "ANGLE|off", value_parser = values::smooth)]
    pub smooth: Option<NormalMode>,
}

#[derive(Debug, Args)]
pub struct InfoArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Prints JSON: an object, or a list of them where several scenes are named; one that fails has
    /// its file and its error
    #[arg(long, help_heading = "Output")]
    pub json: bool,
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Debug, Args)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub output: OutputArgs,
    #[command(flatten)]
    pub look: LookArgs,
    #[command(flatten)]
    pub time: TimeArgs,
    #[command(flatten)]
    pub moment: MomentArgs,
    #[command(flatten)]
    pub process: ProcessArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

#[derive(Debug, Args)]
pub struct TurntableArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub output: OutputArgs,
    #[command(flatten)]
    pub turn: TurnArgs,
    #[command(flatten)]
    pub look: LookArgs,
    #[command(flatten)]
    pub moment: MomentArgs,
    #[command(flatten)]
    pub process: ProcessArgs,
    #[command(flatten)]
    pub common: CommonArgs,
}

/// What pictures look like.
#[derive(Debug, Args)]
pub struct LookArgs {
    #[command(flatten)]
    pub image: ImageArgs,
    #[command(flatten)]
    pub camera: CameraArgs,
    #[command(flatten)]
    pub light: LightArgs,
    #[command(flatten)]
    pub shading: ShadingArgs,
}
