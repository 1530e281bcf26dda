//! Resolves a render plan into a farm job: checks options, then reads the scene once and turns everything that tasks
//! share into flags.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail};

use super::camera_flags;
use super::farm_job::{Assembly, FarmJob, InputFile};
use super::job_output::{JobAnimation, JobOutput, assemble_args};
use super::job_paths::{JobFolder, JobPath};
use super::job_text::text_args;
use crate::args::{CAMERA_FLAGS, EngineArgs, ExplicitFlags, JobCommand};
use crate::plan::{RenderPlan, frames_of_file};
use crate::run::load_scene::load_scene;
use crate::run::progress::SceneLog;
use crate::scene_file::is_stdin;
use crate::usage::UsageError;
use blinn_core::cancellation::CancelToken;
use blinn_scene::{ClipBoundsCache, PosedScene, Scene};
use blinn_session::{
    EnvironmentSource, FrameList, PathTemplate, Permit, ResolvedExposure, SceneRenderer, SettingsHash,
};

/// Flags that a job sets itself or drops.
const JOB_FLAGS: [&str; 14] = [
    "output",
    "config",
    "resume",
    "progress",
    "frames",
    "only",
    "exposure",
    "size",
    "camera-xml",
    "cameras",
    "hdri",
    "threads",
    "max-memory",
    "print-config",
];

/// Returns an error if a dataset has files outside the folder of its images, which engines do not collect.
fn check_dataset(plan: &RenderPlan, scene: &Path) -> Result<(), UsageError> {
    if plan.session.dataset.is_none() {
        return Ok(());
    }
    if plan.formats.is_merged {
        return Err(UsageError("--merge: a job renders one scene; run turntable, or remove it".into()));
    }
    let transforms = plan.outputs.transforms_file(scene, 1);
    let images = transforms.parent().unwrap_or(Path::new(""));
    match plan.dataset_files(scene, 1).into_iter().find(|file| !file.starts_with(images)) {
        Some(file) => Err(UsageError(format!(
            "--dataset: a job cannot write {}, outside the folder of the images; run turntable, or remove that format",
            file.display()
        ))),
        None => Ok(()),
    }
}

/// Default maximum number of tasks: Slurm's default limit.
const MAX_TASKS: usize = 1000;
/// Default number of frames per task.
const CHUNK_SIZE: usize = 10;

/// A job before its scene is read.
pub struct JobPlan<'a> {
    engine: &'a EngineArgs,
    plan: &'a RenderPlan,
    flags: ExplicitFlags,
    /// The scene's file.
    pub file: PathBuf,
    scene: JobPath,
    scene_folder: JobPath,
    inputs: Vec<InputFile>,
    output: JobOutput,
    output_folder: JobPath,
}

impl<'a> JobPlan<'a> {
    /// # Errors
    /// Plans that are no job: several scenes, a single image, flags that make sense only for one process.
    pub fn new(
        engine: &'a EngineArgs,
        plan: &'a RenderPlan,
        flags: ExplicitFlags,
        folder: &JobFolder,
    ) -> Result<Self, UsageError> {
        check_flags(&flags)?;
        let Some(scene) = plan.scenes.single() else {
            let count = plan.scenes.len();
            return Err(UsageError(format!("a job renders one scene, not {count}; make a job for each")));
        };
        if is_stdin(&scene) {
            return Err(UsageError(
                "the tasks of a job read their scene from a file; save standard input".into(),
            ));
        }
        if !plan.frames.is_sequence() {
            return Err(UsageError("a job renders several frames; add --frames or --cameras".into()));
        }
        let output = JobOutput::new(engine.command(), plan, &scene)?;
        check_dataset(plan, &scene)?;
        let output_folder = folder.job_path(&output.folder)?;
        if !PathTemplate::parse(&output_folder.path).is_literal() {
            let name = &output_folder.path;
            return Err(UsageError(format!("{name}: the folder's name contains a placeholder; rename it")));
        }
        let options = engine.command().options();
        let hdri = options.value("hdri").filter(|hdri| is_hdri_file(hdri));
        let files = [("camera-xml", options.value("camera-xml")), ("hdri", hdri)];
        let mut inputs = Vec::new();
        if let Some(cameras) = &plan.session.cameras {
            let (path, is_folder) = cameras.input();
            inputs.push(InputFile { flag: "cameras", path: folder.job_path(path)?, is_folder });
        }
        for (flag, file) in files {
            if let Some(file) = file {
                let mut path = folder.job_path(Path::new(file))?;
                if flag == "hdri" && !is_hdri_file(path.path.as_ref()) {
                    path.path = format!("./{}", path.path);
                }
                inputs.push(InputFile { flag, path, is_folder: false });
            }
        }
        let scene_folder = folder.job_path(scene.parent().unwrap_or(Path::new("")))?;
        let file = folder.job_path(&scene)?;
        Ok(JobPlan {
            engine,
            plan,
            flags,
            file: scene,
            scene: file,
            scene_folder,
            inputs,
            output,
            output_folder,
        })
    }

    /// Reads the scene and resolves what all tasks share.
    pub fn resolve(self, log: &SceneLog) -> Result<FarmJob> {
        let plan = self.plan;
        let scene = load_scene(plan, &self.file, log, &Permit::alone(), &CancelToken::default())?;
        let (renderer, start) = SceneRenderer::new(
            &plan.session,
            &scene,
            1,
            log,
            &ClipBoundsCache::default(),
            &CancelToken::default(),
        )?;
        if let Some(JobAnimation { output, file }) = &self.output.animation {
            output.format.check_size(renderer.size()).map_err(|text| anyhow!("-o {file}: {text}"))?;
        }
        let size = plan.session.options.size_for(&scene);
        let camera = self.camera_flags(&scene, &start.posed, size)?;
        let replaces_camera = camera.is_some();
        let (command, frames_flag) = match self.engine.command() {
            JobCommand::Render(_) if plan.session.cameras.is_some() => ("render", "--only"),
            JobCommand::Render(_) => ("render", "--frames"),
            JobCommand::Turntable(_) => ("turntable", "--only"),
        };
        let args = self.task_args(command, size, &renderer.exposure, camera);
        let mut inputs = self.inputs;
        if replaces_camera {
            inputs.retain(|input| input.flag != "camera-xml");
        }
        let numbers: Vec<i64> = plan
            .frames
            .resolve(renderer.setup.clip_duration, frames_of_file(&scene))?
            .iter()
            .map(|frame| frame.number)
            .collect();
        let frames = FrameList::ascending(numbers.iter().copied());
        let mut output_pattern = self.output.pattern;
        let mut assembly = None;
        if let Some(animation) = self.output.animation {
            if frames.frames() != numbers || numbers.first().is_some_and(|first| *first < 0) {
                bail!(
                    "--frames: an animation is assembled in the order of frame numbers; they must be ascending and \
                     not negative"
                );
            }
            // The hash separates frames with other options.
            let identity = SettingsHash::of(&(command, &self.scene.path, &args, &frames));
            let frames_folder = format!("frames-{:08x}", identity.hash() as u32);
            output_pattern = format!("{frames_folder}/####.png");
            let output = animation.output.in_scene(&scene);
            let output = output.map_err(|text| anyhow!("-o {}: {text}", animation.file))?;
            let args = assemble_args(&output);
            assembly = Some(Assembly { frames_folder, file: animation.file, args });
        }
        let default_chunk_size = CHUNK_SIZE.max(frames.frames().len().div_ceil(MAX_TASKS)) as u32;
        Ok(FarmJob {
            command,
            scene: self.scene,
            scene_folder: (!scene.source.files.is_empty()).then_some(self.scene_folder),
            args,
            inputs,
            frames,
            frames_flag,
            output_folder: self.output_folder,
            output_pattern,
            assembly,
            chunk_size: self.engine.job().chunk_size.unwrap_or(default_chunk_size),
            threads: self.engine.command().process().threads,
            max_memory: plan.session.max_memory,
        })
    }

    /// The arguments of every task: the given flags, and what is resolved for all tasks in place of some of them.
    fn task_args(
        &self,
        command: &str,
        size: (u32, u32),
        exposure: &ResolvedExposure,
        camera: Option<Vec<String>>,
    ) -> Vec<String> {
        let mut flags = self.flags.clone().without(&JOB_FLAGS);
        let mut resolved = Vec::new();
        // The images of a list have sizes of their own.
        if self.plan.session.cameras.is_none() || self.engine.command().options().contains("size") {
            resolved.push(format!("--size={}x{}", size.0, size.1));
        }
        resolved.push(format!("--exposure={}", exposure.ev));
        if let Some(name) = hdri_name(self.engine) {
            resolved.push(format!("--hdri={name}"));
        }
        if let Some(light_scale) = exposure.light_scale {
            flags = flags.without(&["light-scale"]);
            resolved.push(format!("--light-scale={light_scale}"));
        }
        if let Some(camera) = camera {
            flags = flags.without(&CAMERA_FLAGS).without(&camera_flags::FRAMING_FLAGS);
            resolved.extend(camera);
        }
        if self.output.animation.is_some() {
            // They apply to the animation. --fps also gives the times of a clip's frames, but not of a turntable's.
            flags = flags.without(&["quality", "loop"]);
            if command == "turntable" {
                flags = flags.without(&["fps"]);
            }
        }
        [text_args(&flags), resolved].concat()
    }

    /// The resolved camera as flags. A file's camera may move, and a dataset or a list has many, so they have none.
    fn camera_flags(
        &self,
        scene: &Scene,
        posed: &PosedScene,
        size: (u32, u32),
    ) -> Result<Option<Vec<String>>> {
        let view = &self.plan.session.options.view;
        if self.plan.session.dataset.is_some()
            || self.plan.session.cameras.is_some()
            || view.uses_file_camera(scene)
        {
            return Ok(None);
        }
        let (camera, _) = view.resolve(posed, size.0, size.1)?;
        Ok(camera_flags::camera_flags(&camera))
    }
}

/// The environment of a job that is no file.
fn hdri_name(engine: &EngineArgs) -> Option<&str> {
    engine.command().options().value("hdri").filter(|hdri| !is_hdri_file(hdri))?.to_str()
}

/// True if a value of --hdri is a file.
fn is_hdri_file(value: &OsStr) -> bool {
    EnvironmentSource::new(value.as_ref()).file().is_some()
}

fn check_flags(flags: &ExplicitFlags) -> Result<(), UsageError> {
    for (flag, reason) in [
        ("chunk", "the farm distributes the frames; remove it, and set --chunk-size before the command"),
        ("no-overwrite", "a task that runs again keeps finished images; remove it"),
        ("report", "every task would write it; remove it"),
        ("trace", "every task would write it; remove it"),
        ("ledger", "a job renders one scene; remove it"),
        ("watch", "a job renders each frame once; remove it"),
        ("dry-run", "a job is only printed, nothing is rendered; remove it"),
    ] {
        if flags.contains(flag) {
            return Err(UsageError(format!("--{flag}: {reason}")));
        }
    }
    Ok(())
}
