//! From words to a plan: what is rendered, how, and where it goes. Whatever can be found wrong
//! without reading a scene is found here.

mod animation;
mod clips;
mod dataset;
pub(crate) mod memory;
mod outputs;
mod path_conflicts;
mod render_options;
mod scenes;
mod shots;
mod turntable;

use std::path::{Path, PathBuf};

use crate::accel::BuildSettings;
use crate::batch::SettingsHash;
use crate::cli::Usage;
use crate::cli::args::{LookArgs, ProcessArgs, RenderArgs, TurntableArgs};
use crate::cli::console::is_stdout;

pub use animation::Playing;
pub use dataset::Views;
pub use outputs::{Form, Outputs, Series, Target};
pub use path_conflicts::{Claims, Writer};
pub use render_options::{Look, load_options, natural_size, tier};
pub use scenes::list as scene_list;
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
    /// Set for datasets.
    pub views: Option<Views>,
    pub strict: bool,
    /// Bytes of memory that a scene and its pictures may take.
    pub max_memory: Option<u64>,
    /// Whether files are only named.
    pub dry_run: bool,
}

impl Job {
    /// What `blinn render` was asked for.
    pub fn render(args: &RenderArgs) -> Result<Job, Usage> {
        let limits = memory::limits(args.process.max_memory);
        let animation = args.moment.animation.as_deref();
        let look = Look::new(&args.look, &args.scene, animation, &args.common, &limits)?;
        let shots = Shots::of_clip(&args.time, &args.moment)?;
        let share = args.time.chunk.map(|_| "--chunk");
        let series = Series { many: shots.are_many(), fps: args.time.fps, share, clockwise: false };
        Job {
            scenes: scenes::list(&args.scene.scenes)?,
            outputs: Outputs::new(&args.output, &series, &look)?,
            shots,
            look,
            build: BuildSettings {
                simd: render_options::tier(std::env::var_os("BLINN_SIMD"))?,
                ..Default::default()
            },
            views: None,
            strict: args.common.strict,
            max_memory: args.process.max_memory,
            dry_run: args.process.dry_run,
        }
        .checked(&args.look, &args.process)
    }

    /// What `blinn turntable` was asked for.
    pub fn turntable(args: &TurntableArgs) -> Result<Job, Usage> {
        let animation = args.moment.animation.as_deref();
        let limits = memory::limits(args.process.max_memory);
        let mut look = Look::new(&args.look, &args.scene, animation, &args.common, &limits)?;
        let views = args.turn.views.map(|count| Views::new(count, args, &mut look)).transpose()?;
        if views.is_none() {
            look.turning = Some(turntable::turning(&args.turn));
            turntable::place_camera(&args.turn, &mut look)?;
        }
        let shots = turntable::shots(&args.turn, args.moment.time.unwrap_or(0.0))?;
        let outputs = Outputs::new(&args.output, &turntable::series(&args.turn), &look)?;
        if args.turn.fps.is_some() && !matches!(outputs.form, Form::Moving(_)) {
            return Err(Usage(
                "--fps is of moving pictures, and -o names none: write .gif, .apng, .mp4 or .html".into(),
            ));
        }
        Job {
            scenes: scenes::list(&args.scene.scenes)?,
            outputs,
            shots,
            look,
            build: BuildSettings {
                simd: render_options::tier(std::env::var_os("BLINN_SIMD"))?,
                ..Default::default()
            },
            views,
            strict: args.common.strict,
            max_memory: args.process.max_memory,
            dry_run: args.process.dry_run,
        }
        .checked(&args.look, &args.process)
    }

    /// What decides a picture beside the files that it is made from.
    pub fn key(&self, shot: &Shot) -> SettingsHash {
        SettingsHash::of(&(
            &self.look,
            self.outputs.form,
            shot.time,
            shot.angle,
            shot.orbit,
            self.views.map(|v| (v.count, v.up)),
        ))
        .strict(self.strict)
    }

    /// All files that the `index`-th scene's pictures become, and what lies beside them.
    pub fn files(&self, scene: &Path, index: usize, shots: &[Shot]) -> Vec<PathBuf> {
        let of = |shot| self.outputs.files(&self.outputs.target(scene, index, shot));
        let mut files: Vec<PathBuf> = shots.iter().flat_map(of).collect();
        // Frames of a moving picture share a file.
        files.dedup();
        files.extend(self.views.map(|views| views.file(&self.outputs, scene, index)));
        files
    }

    /// Refuses names that collide, and those of files that are read. Where the frames are known only once
    /// a scene is read, the first of each is looked at.
    fn checked(self, look: &LookArgs, process: &ProcessArgs) -> Result<Job, Usage> {
        let given = [&look.light.hdri, &look.camera.camera_xml, &process.config];
        let mut claims = Claims::of_read(self.scenes.iter().chain(given.into_iter().flatten()));
        let report = process.report.as_deref();
        self.outputs.check_stdout(&self.scenes, report.is_some_and(is_stdout))?;
        self.views.map_or(Ok(()), |views| views.check_names(&self.scenes, &self.outputs))?;
        let shots = self.shots.known().filter(|shots| !shots.is_empty());
        let shots = shots.unwrap_or_else(|| vec![Shot::at(1, 0.0)]);
        for (i, scene) in self.scenes.iter().enumerate() {
            for file in self.files(scene, i + 1, &shots) {
                claims.write(&file, Writer::Scene(scene)).map_err(Usage)?;
            }
        }
        if let Some(report) = report.filter(|report| !is_stdout(report)) {
            claims.write(report, Writer::Flag("--report")).map_err(Usage)?;
        }
        Ok(self)
    }
}
