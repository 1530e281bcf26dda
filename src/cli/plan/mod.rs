//! Resolves arguments into a plan: what is rendered, how, and where it is written. Finds every error that needs no
//! scene to be read.

mod animation_output;
mod camera_checks;
mod camera_list;
mod check;
mod clip_conflicts;
mod dataset;
mod dataset_formats;
mod frame_neighbours;
mod frames;
mod memory_limit;
mod outputs;
mod path_conflicts;
mod render_options;
mod scene_list;
mod sequence_info;
mod simd_level;
mod turntable;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::args::values::{AovSelection, HdriArg};
use super::args::{ProcessArgs, RenderArgs, RenderOptionArgs, TurntableArgs};
use super::console::is_stdout;
use super::usage::UsageError;
use crate::accel::BuildSettings;
use crate::batch::{SettingsHash, WorldUp};
use crate::render::RenderSettings;
use crate::scene::View;

pub use animation_output::AnimationOutput;
pub use camera_list::{CameraList, SizedCamera};
pub use check::CheckPlan;
pub use dataset::DatasetPlan;
pub use dataset_formats::{BopFolders, FormatsPlan, coco_file, colmap_folder};
pub use frame_neighbours::FrameNeighbours;
pub use frames::{FrameSet, PlannedFrame};
pub use memory_limit::load_limits;
pub use outputs::{OutputKind, Outputs, Target};
pub use path_conflicts::{PathConflicts, Writer};
pub use render_options::{
    BackFaceCulling, RenderOptions, TurntableRotation, load_options, natural_size, scaled_to,
};
pub use scene_list::scene_list;
pub use simd_level::simd_level;

use camera_checks::check_cameras;
use sequence_info::SequenceInfo;

/// Images of one or more scenes.
#[derive(Clone, Debug)]
pub struct RenderPlan {
    pub scenes: Vec<PathBuf>,
    /// The frames of each scene.
    pub frames: FrameSet,
    /// The frames before and after each frame, for layers of flow.
    pub neighbours: FrameNeighbours,
    pub options: RenderOptions,
    pub outputs: Outputs,
    pub build: BuildSettings,
    /// Set for `turntable --views`.
    pub dataset: Option<DatasetPlan>,
    /// The formats of the dataset.
    pub formats: FormatsPlan,
    /// Set for `render --cameras`.
    pub cameras: Option<Arc<CameraList>>,
    /// Golden images to compare with.
    pub check: Option<CheckPlan>,
    pub strict: bool,
    /// Memory limit in bytes for a scene and its images.
    pub max_memory: Option<u64>,
    /// True to print the names of output files only.
    pub dry_run: bool,
}

impl RenderPlan {
    /// The plan of `blinn render`.
    pub fn for_render(args: &RenderArgs) -> Result<RenderPlan, UsageError> {
        let animation = args.time.animation.as_deref();
        let mut options =
            RenderOptions::from_args(&args.options, &args.scene, animation, &args.common, &args.process)?;
        let limits = load_limits(args.process.max_memory);
        let cameras =
            CameraList::open(&args.cameras, &args.options.image, args.options.camera.clip, &limits)?
                .map(Arc::new);
        let frames = FrameSet::from_args(&args.frames, &args.time, cameras.as_ref())?;
        let sequence = SequenceInfo {
            is_sequence: frames.is_sequence(),
            has_cameras: cameras.is_some(),
            fps: args.frames.fps,
            subset_flag: args.frames.chunk.map(|_| "--chunk"),
            clockwise: false,
        };
        let outputs = Outputs::new(&args.output, &sequence, &options)?.with_cameras(cameras.as_ref());
        let scenes = scene_list(&args.scene.scenes)?;
        if let Some(cameras) = &cameras {
            if args.frames.fps.is_some() && !matches!(outputs.kind, OutputKind::Animation(_)) {
                return Err(outputs::animation_only("--fps"));
            }
            let first = scenes.first().map_or(Path::new(""), PathBuf::as_path);
            // Limits and buffers suit the largest image.
            options.size = Some(check_cameras(cameras, &outputs, first)?);
        }
        let check = CheckPlan::from_args(&args.check, &outputs)?;
        RenderPlan {
            scenes,
            frames,
            neighbours: FrameNeighbours::of_render(&args.frames),
            options,
            outputs,
            build: build_settings()?,
            dataset: None,
            formats: FormatsPlan::default(),
            cameras,
            check,
            strict: args.common.strict,
            max_memory: args.process.max_memory,
            dry_run: args.process.dry_run,
        }
        .checked(&args.options, &args.process)
    }

    /// The plan of `blinn turntable`.
    pub fn for_turntable(args: &TurntableArgs) -> Result<RenderPlan, UsageError> {
        let animation = args.time.animation.as_deref();
        let mut options =
            RenderOptions::from_args(&args.options, &args.scene, animation, &args.common, &args.process)?;
        let dataset = args.turn.views.map(|count| DatasetPlan::new(count, args, &mut options)).transpose()?;
        if dataset.is_none() {
            options.rotation = Some(turntable::rotation(&args.turn));
            turntable::place_camera(&args.turn, &mut options)?;
        }
        let frames = turntable::frames(&args.turn, args.time.time.unwrap_or(0.0))?;
        let outputs = Outputs::new(&args.output, &turntable::sequence_info(&args.turn), &options)?;
        if args.turn.fps.is_some() && !matches!(outputs.kind, OutputKind::Animation(_)) {
            return Err(outputs::animation_only("--fps"));
        }
        RenderPlan {
            scenes: scene_list(&args.scene.scenes)?,
            frames,
            neighbours: turntable::neighbours(&args.turn),
            options,
            outputs,
            build: build_settings()?,
            dataset,
            formats: FormatsPlan::from_args(&args.turn)?,
            cameras: None,
            check: None,
            strict: args.common.strict,
            max_memory: args.process.max_memory,
            dry_run: args.process.dry_run,
        }
        .checked(&args.options, &args.process)
    }

    /// Hash of everything that decides an image, neither of a dataset nor of a list of cameras, except the input files.
    pub fn settings_hash(&self, frame: &PlannedFrame) -> SettingsHash {
        let has_flow = self.options.aovs.aovs.iter().any(|aov| aov.is_flow());
        let neighbours = has_flow.then(|| [-1, 1].map(|step| self.neighbours.frame(frame, step)));
        let frame = (frame.time, frame.angle, frame.orbit);
        SettingsHash::of(&(&self.options, self.outputs.kind, frame, neighbours)).strict(self.strict)
    }

    /// Hash of everything that decides an image of a dataset or of a list of cameras except the input files. It is the
    /// same for a dataset and for its `transforms.json` as a list, and does not change with other cameras of a list.
    pub fn view_hash(&self, time: f64, view: &SizedCamera) -> SettingsHash {
        let options = &self.options;
        // Lights that follow the camera follow the view at rest.
        let rest = (&options.view.camera, options.view.look_at);
        let aovs = if self.outputs.holds_aovs() { options.aovs.clone() } else { AovSelection::default() };
        let settings = RenderSettings { crop: None, ..options.settings };
        let options = RenderOptions { size: None, view: View::default(), aovs, settings, ..options.clone() };
        let up = match (&self.dataset, &self.cameras) {
            (Some(dataset), _) => dataset.up,
            (None, Some(cameras)) => cameras.world_up(),
            (None, None) => WorldUp::Y,
        };
        let depth_step = options.depth_unit.or(view.depth_step);
        let view = SizedCamera { camera: view.camera.with_positive_zeros(), depth_step, ..*view };
        SettingsHash::of(&(&options, rest, self.outputs.kind, time, view, up)).strict(self.strict)
    }

    /// All files for frames of the `index`-th scene, counted from 1, with previews and the files of a dataset.
    pub fn output_files(&self, scene: &Path, index: usize, frames: &[PlannedFrame]) -> Vec<PathBuf> {
        let files_of = |frame| self.outputs.files(&self.outputs.target(scene, index, frame));
        let mut files: Vec<PathBuf> = frames.iter().flat_map(files_of).collect();
        // All frames of an animation have the same file.
        files.dedup();
        files.extend(self.dataset_files(scene, index));
        files
    }

    /// The files that describe all views of the dataset of a scene.
    pub fn dataset_files(&self, scene: &Path, index: usize) -> Vec<PathBuf> {
        let transforms = self.dataset.map(|dataset| dataset.transforms_file(&self.outputs, scene, index));
        transforms.map_or_else(Vec::new, |transforms| self.formats.shared_files(&transforms))
    }

    /// Checks that no two outputs have the same name and that none is an input. If the number of frames is known only
    /// after reading a scene, its first frame is checked.
    fn checked(self, options: &RenderOptionArgs, process: &ProcessArgs) -> Result<RenderPlan, UsageError> {
        let hdri = options.light.hdri.as_ref().and_then(HdriArg::file);
        let cameras = self.cameras.as_ref().map(|cameras| cameras.path().to_path_buf());
        let option_files =
            [hdri, options.camera.camera_xml.as_ref(), process.config.as_ref(), cameras.as_ref()];
        let mut paths =
            PathConflicts::with_inputs(self.scenes.iter().chain(option_files.into_iter().flatten()));
        let report = process.report.as_deref();
        self.neighbours.check(&self.options)?;
        self.outputs.check_stdout(&self.scenes, report.is_some_and(is_stdout))?;
        if let Some(dataset) = &self.dataset {
            dataset.check_names(&self.scenes, &self.outputs)?;
            self.formats.check_names(dataset, &self.scenes, &self.outputs)?;
        }
        let frames = match self.frames {
            // Their names were checked. Those of other scenes are alike.
            FrameSet::Cameras { .. } => {
                Some(vec![PlannedFrame { camera: Some(0), ..PlannedFrame::at(1, 0.0) }])
            }
            _ => self.frames.known().filter(|frames| !frames.is_empty()),
        };
        let frames = frames.unwrap_or_else(|| vec![PlannedFrame::at(1, 0.0)]);
        if let Some(check) = &self.check {
            let files =
                self.scenes.iter().enumerate().map(|(i, scene)| self.output_files(scene, i + 1, &frames));
            check.check_names(&files.flatten().collect::<Vec<_>>())?;
        }
        for (i, scene) in self.scenes.iter().enumerate() {
            for file in self.output_files(scene, i + 1, &frames) {
                paths.add_output(&file, Writer::Scene(scene)).map_err(UsageError)?;
            }
        }
        if let Some(report) = report.filter(|report| !is_stdout(report)) {
            paths.add_output(report, Writer::Flag("--report")).map_err(UsageError)?;
        }
        Ok(self)
    }
}

fn build_settings() -> Result<BuildSettings, UsageError> {
    Ok(BuildSettings { simd: simd_level(std::env::var_os("BLINN_SIMD"))?, ..Default::default() })
}
