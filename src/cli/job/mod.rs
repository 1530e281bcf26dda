//! From words to a plan: what is rendered, how, and where it goes. Whatever can be found wrong
//! without reading a scene is found here.

mod look;
mod outputs;
mod scenes;
mod shots;
mod turntable;

use std::path::PathBuf;

use super::Usage;
use super::args::{RenderArgs, TurntableArgs};
use crate::accel::BuildSettings;
use crate::batch::Key;

pub use look::{Look, load_options, natural_size};
pub use outputs::{Outputs, Target};
pub use shots::{Shot, Shots};
pub use turntable::Turning;

/// Pictures of many scenes.
#[derive(Debug)]
pub struct Job {
    pub scenes: Vec<PathBuf>,
    pub shots: Shots,
    pub look: Look,
    pub outputs: Outputs,
    pub build: BuildSettings,
    pub strict: bool,
    /// Whether files are only named.
    pub dry_run: bool,
}

impl Job {
    /// What `blinn render` was asked for.
    pub fn render(args: &RenderArgs) -> Result<Job, Usage> {
        let look = Look::new(&args.look, &args.scene, args.moment.animation.as_deref(), &args.common)?;
        let shots = Shots::of_clip(&args.time, &args.moment);
        Job {
            scenes: scenes::list(&args.scene.scenes)?,
            outputs: Outputs::new(&args.output, shots.are_many(), &look)?,
            shots,
            look,
            build: BuildSettings { tier: look::tier(std::env::var_os("BLINN_SIMD"))?, ..Default::default() },
            strict: args.common.strict,
            dry_run: args.process.dry_run,
        }
        .checked()
    }

    /// What `blinn turntable` was asked for.
    pub fn turntable(args: &TurntableArgs) -> Result<Job, Usage> {
        let animation = args.moment.animation.as_deref();
        let mut look = Look::new(&args.look, &args.scene, animation, &args.common)?;
        look.turning = Some(turntable::turning(&args.turn));
        turntable::place_camera(&args.turn, &mut look)?;
        let shots = turntable::shots(&args.turn, args.moment.time.unwrap_or(0.0))?;
        Job {
            scenes: scenes::list(&args.scene.scenes)?,
            outputs: Outputs::new(&args.output, shots.are_many(), &look)?,
            shots,
            look,
            build: BuildSettings { tier: look::tier(std::env::var_os("BLINN_SIMD"))?, ..Default::default() },
            strict: args.common.strict,
            dry_run: args.process.dry_run,
        }
        .checked()
    }

    /// What decides a picture beside the files that it is made from.
    pub fn key(&self, shot: &Shot) -> Key {
        Key::of(&(&self.look, self.outputs.format, self.outputs.depth, shot.time, shot.angle))
    }

    /// Refuses names that collide.
    fn checked(self) -> Result<Job, Usage> {
        self.outputs.check_names(&self.scenes, &self.shots.known().unwrap_or_default())?;
        Ok(self)
    }
}
