//! Command line arguments as typed, before they are resolved into a plan.

pub(super) mod argv;
mod assemble;
mod bench;
mod choices;
pub(super) mod command_tree;
pub(super) mod config;
mod farm;
mod foreign_flags;
pub(super) mod help;
mod info;
mod output;
mod packaging;
mod process;
mod render;
mod render_options;
mod root;
mod scene;
mod time;
mod turntable;
pub(super) mod usage_error;
pub(super) mod values;

pub use assemble::AssembleArgs;
pub use bench::BenchArgs;
pub use choices::*;
pub use farm::{EngineArgs, JobArgs, JobCommand};
pub use info::InfoArgs;
pub use output::OutputArgs;
pub use packaging::{CompletionsArgs, ManArgs};
pub use process::{CommonArgs, LogArgs, ProcessArgs};
pub use render::RenderArgs;
pub use render_options::{CameraArgs, ImageArgs, LightArgs, RenderOptionArgs, ShadingArgs};
pub use root::{Cli, Command};
pub use scene::SceneArgs;
pub use time::{FrameArgs, TimeArgs};
pub use turntable::{TurnArgs, TurntableArgs};
