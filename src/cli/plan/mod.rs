//! Resolves arguments into a plan: what is rendered, how, and where it is written. Finds every error that needs no
//! scene to be read.

mod animation_output;
mod camera_checks;
mod check;
mod clip_conflicts;
mod command_files;
mod dataset;
mod dataset_folders;
mod dataset_formats;
mod frames;
mod images;
mod inputs;
mod output_names;
mod outputs;
mod path_conflicts;
mod scene_list;
mod scene_plan;
mod sequence_info;
mod shards;
mod shared_categories;
mod turntable;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::args::values::DatasetFormat;
use super::args::{ProcessArgs, RenderArgs, TurntableArgs};
use super::console::is_stdout;
use super::usage::UsageError;
use blinn_accel::AccelSettings;
use blinn_core::worded;
use blinn_output::datasets::WorldUp;
use blinn_session::{
    Chunk, EnvironmentSource, FrameNeighbours, ImageCamera, PlannedFrame, SessionPlan, SettingsHash,
    simd_level,
};

pub use animation_output::{AnimationOutput, check_animation};
pub use check::CheckPlan;
pub use command_files::NumberedScene;
pub use dataset_folders::{ArchiveFolder, DatasetFolders, MergedFolder};
pub use dataset_formats::FormatsPlan;
pub use frames::{ClipFrames, FrameSet, frames_of_file};
pub use images::ImagePolicy;
pub use inputs::{PlanInputs, check_only, open_cameras};
pub use outputs::{OutputKind, Outputs, Target, split_existing_folder};
pub use path_conflicts::{PathConflicts, Writer};
pub use scene_list::{SceneList, scene_list};
pub use shards::{ShardPlan, scene_of_key};
pub use shared_categories::{SceneNames, SharedCategories};

use camera_checks::check_cameras;
use command_files::OptionFiles;
use dataset::dataset_plan;
use sequence_info::SequenceInfo;

/// Images of one or more scenes.
#[derive(Clone, Debug)]
pub struct RenderPlan {
    pub scenes: Arc<SceneList>,
    /// The part of the scenes or of their frames to render.
    pub chunk: ScopedChunk,
    /// The frames of each scene.
    pub frames: FrameSet,
    /// Options and cameras of the images of each scene.
    pub session: SessionPlan,
    pub outputs: Outputs,
    /// The formats of the dataset.
    pub formats: FormatsPlan,
    /// Golden images to compare with.
    pub check: Option<CheckPlan>,
    /// True for random cameras and lights of its own for each scene of a dataset.
    pub random_per_scene: bool,
    pub strict: bool,
    /// True to print the names of output files only.
    pub dry_run: bool,
}

impl RenderPlan {
    /// The plan of `blinn render`.
    pub fn for_render(args: &RenderArgs, inputs: PlanInputs) -> Result<RenderPlan, UsageError> {
        let PlanInputs { mut options, scenes, cameras } = inputs;
        let chunk =
            ScopedChunk::new(args.frames.chunk, &scenes, args.frames.frames.is_some() || cameras.is_some())?;
        let frames = match &cameras {
            Some(cameras) => FrameSet::of_cameras(&args.cameras, &args.time, cameras, chunk.frames)?,
            None => FrameSet::from_args(&args.frames, &args.time, chunk.frames)?,
        };
        let sequence = SequenceInfo {
            is_sequence: frames.is_sequence(),
            is_batch: scenes.is_batch(),
            image_name: None,
            has_cameras: cameras.is_some(),
            fps: args.frames.fps,
            is_clip: cameras.is_none(),
            subset_option: args.cameras.only.as_ref().map(|_| "only").or(chunk.frames.map(|_| "chunk")),
            clockwise: false,
        };
        let outputs =
            Outputs::new(&args.output, &sequence, &frames, &options)?.with_cameras(cameras.as_ref());
        chunk.check_shards(&outputs)?;
        if let Some(cameras) = &cameras {
            if args.frames.fps.is_some() && !matches!(outputs.kind, OutputKind::Animation(_)) {
                return Err(outputs::animation_only("fps"));
            }
            // Limits and buffers suit the largest image.
            options.size = Some(check_cameras(cameras, &outputs, &scenes.first()?)?);
        }
        let neighbours = match &cameras {
            Some(cameras) => FrameNeighbours::of_cameras(cameras, &options)?,
            None => frames::neighbours(&args.frames),
        };
        let check = CheckPlan::from_args(&args.check, &outputs)?;
        RenderPlan {
            scenes,
            chunk,
            frames,
            session: SessionPlan {
                options,
                build: build_settings()?,
                neighbours,
                dataset: None,
                cameras,
                holds_layers: outputs.holds_aovs(),
                encoding_bytes: outputs.encoding_bytes(),
                max_memory: args.process.max_memory,
            },
            outputs,
            formats: FormatsPlan::default(),
            check,
            random_per_scene: false,
            strict: args.common.strict,
            dry_run: args.process.dry_run,
        }
        .checked(Some(&args.process))
    }

    /// The plan of `blinn turntable`.
    pub fn for_turntable(args: &TurntableArgs, inputs: PlanInputs) -> Result<RenderPlan, UsageError> {
        let PlanInputs { mut options, scenes, .. } = inputs;
        turntable::check_dataset_options(&args.turn)?;
        let dataset = args.turn.views.map(|count| dataset_plan(count, args, &mut options)).transpose()?;
        if dataset.is_none() {
            options.rotation = Some(turntable::rotation(&args.turn));
            turntable::place_camera(&args.turn, &mut options)?;
        }
        let chunk = ScopedChunk::new(args.turn.chunk, &scenes, true)?;
        let time = args.time.time.unwrap_or(0.0);
        let frames = turntable::frames(&args.turn, time, dataset.as_ref(), chunk.frames)?;
        let mut formats = FormatsPlan::from_args(&args.turn)?;
        let sequence = SequenceInfo {
            is_batch: scenes.is_batch(),
            image_name: dataset.as_ref().and_then(|_| formats.image_name(scenes.is_batch())),
            ..turntable::sequence_info(&args.turn, chunk.frames)
        };
        let outputs = Outputs::new(&args.output, &sequence, &frames, &options)?;
        if outputs.shards.is_some() && formats.coco_masks().is_some() {
            formats.shared_categories = Arc::new(SharedCategories::new(&formats.categories, &scenes)?);
        }
        let has_bop = formats.has(DatasetFormat::Bop);
        let outputs = if has_bop { outputs.with_bop_names() } else { outputs };
        chunk.check_shards(&outputs)?;
        if args.turn.fps.is_some() && !matches!(outputs.kind, OutputKind::Animation(_)) {
            return Err(outputs::animation_only("fps"));
        }
        RenderPlan {
            scenes,
            chunk,
            frames,
            session: SessionPlan {
                options,
                build: build_settings()?,
                neighbours: turntable::neighbours(&args.turn),
                dataset,
                cameras: None,
                holds_layers: outputs.holds_aovs(),
                encoding_bytes: outputs.encoding_bytes(),
                max_memory: args.process.max_memory,
            },
            outputs,
            formats,
            check: None,
            random_per_scene: args.turn.sampling.random_per_scene,
            strict: args.common.strict,
            dry_run: args.process.dry_run,
        }
        .checked(Some(&args.process))
    }

    /// Hash of everything that decides an image, neither of a dataset nor of a list of cameras, except the input files.
    pub fn settings_hash(&self, frame: &PlannedFrame) -> SettingsHash {
        self.session.settings_hash(&self.outputs.kind, frame).strict(self.strict)
    }

    /// Hash of everything that decides an image of a dataset or of a list of cameras except the input files.
    pub fn view_hash(&self, frame: &PlannedFrame, view: &ImageCamera) -> SettingsHash {
        self.session.view_hash(&self.outputs.kind, frame, view).strict(self.strict)
    }

    /// Hash of everything that decides an image in an archive except the input files, whatever its scene. `None` if its
    /// camera is not found in the list.
    pub fn member_hash(&self, frame: &PlannedFrame) -> Option<SettingsHash> {
        if let (Some(cameras), Some(index)) = (&self.session.cameras, frame.camera) {
            return Some(self.view_hash(frame, &cameras.camera(index).ok()?));
        }
        let settings = (self.settings_hash(frame).hash(), self.described_views());
        let hash = match self.formats.describes_samples() {
            true => SettingsHash::of(&(settings, &self.formats)),
            false => SettingsHash::of(&settings),
        };
        Some(hash.strict(self.strict))
    }

    /// Settings of a dataset that the descriptions of its views depend on: their number and the up axis.
    fn described_views(&self) -> Option<(u32, WorldUp)> {
        self.session.dataset.map(|dataset| (dataset.count, dataset.up))
    }

    /// Hash of everything that decides the images of a scene except its files.
    pub fn scene_settings_hash(&self) -> SettingsHash {
        let dataset = self.described_views();
        let world_up = self.session.cameras.as_ref().map(|cameras| cameras.world_up());
        let formats = (&self.session.neighbours, &self.formats, world_up);
        SettingsHash::of(&(&self.session.options, self.outputs.kind, &self.frames, dataset, formats))
            .strict(self.strict)
    }

    /// The indices of the scenes to render, from 0.
    pub fn scene_range(&self) -> Range<usize> {
        let count = self.scenes.len();
        match (self.chunk.scenes, &self.outputs.shards) {
            (None, _) => 0..count,
            (Some(chunk), None) => chunk.range(count),
            // Each archive is written by one share.
            (Some(chunk), Some(shards)) => shards.scenes(chunk.range(shards.count(count)), count),
        }
    }

    /// All files for frames of the `index`-th scene, counted from 1, with previews and the files of a dataset.
    pub fn output_files(&self, scene: &Path, index: usize, frames: &[PlannedFrame]) -> Vec<PathBuf> {
        if let Some(shards) = &self.outputs.shards {
            // The number of archives of limited bytes is not known.
            return if shards.max_bytes().is_none() { vec![shards.file(index)] } else { Vec::new() };
        }
        let files_of = |frame| self.outputs.files(&self.outputs.target(scene, index, frame));
        let mut files: Vec<PathBuf> = frames.iter().flat_map(files_of).collect();
        // All frames of an animation have the same file.
        files.dedup();
        files.extend(self.dataset_files(scene, index));
        files
    }

    /// Number of files that all scenes will probably have; 0 if it is not known before they are read.
    pub fn expected_files(&self) -> usize {
        let (Ok(scene), Some(frames)) = (self.scenes.first(), self.frames.known()) else { return 0 };
        let Some(first) = frames.first() else { return 0 };
        let images = if matches!(self.outputs.kind, OutputKind::Images(_)) { frames.len() } else { 1 };
        let files_of_image = self.outputs.files(&self.outputs.target(&scene, 1, first)).len();
        let files = images.saturating_mul(files_of_image) + self.dataset_files(&scene, 1).len();
        self.scene_range().len().saturating_mul(files)
    }

    /// True for all scenes of a list or a folder, not a share of them or a list of their names.
    pub fn is_whole_batch(&self) -> bool {
        self.scenes.is_batch() && self.chunk.scenes.is_none() && !self.dry_run
    }

    /// The files that describe all views of the dataset of a scene.
    pub fn dataset_files(&self, scene: &Path, index: usize) -> Vec<PathBuf> {
        if self.session.dataset.is_none() {
            return Vec::new();
        }
        self.dataset_folders(scene, index).files(&self.formats)
    }

    /// The folders of the dataset of the `index`-th scene, counted from 1.
    pub fn dataset_folders(&self, scene: &Path, index: usize) -> DatasetFolders {
        let transforms = self.outputs.transforms_file(scene, index);
        if let Some(archives) = self.archive_folder() {
            return DatasetFolders::of_archive(transforms, &archives, index);
        }
        let merged = self.formats.is_merged.then(|| MergedFolder::of(&transforms, &self.formats));
        match merged {
            Some(Ok(merged)) => DatasetFolders::of_merged(transforms, &merged, index),
            _ => DatasetFolders::of_scene(transforms),
        }
    }

    /// The files beside archives of BOP; `None` for other outputs.
    pub fn archive_folder(&self) -> Option<ArchiveFolder> {
        let shards = self.outputs.shards.as_ref().filter(|_| self.formats.has(DatasetFormat::Bop))?;
        shards.folder().map(|folder| ArchiveFolder::of(&folder))
    }

    /// Number of images in the scenes before the `index`-th of a merged dataset, in which each has as many; 0 in others.
    /// `None` for more than there are numbers.
    pub fn images_before(&self, index: usize) -> Option<i64> {
        if !self.formats.is_merged {
            return Some(0);
        }
        let views = self.session.dataset.map_or(0, |dataset| i64::from(dataset.count));
        i64::try_from(index.saturating_sub(1)).ok()?.checked_mul(views)
    }

    /// The folder of the dataset that all scenes share, if there is one.
    ///
    /// # Errors
    /// The list of scenes cannot be read.
    pub fn merged_folder(&self) -> Result<Option<MergedFolder>, UsageError> {
        if !self.formats.is_merged {
            return Ok(None);
        }
        let transforms = self.outputs.transforms_file(&self.scenes.first()?, 1);
        MergedFolder::of(&transforms, &self.formats).map(Some)
    }

    /// Checks that no two outputs have the same name and that none is an input. `process` names files of the process.
    fn checked(self, process: Option<&ProcessArgs>) -> Result<RenderPlan, UsageError> {
        let options = &self.session.options;
        let hdri = options.environment.as_ref().and_then(EnvironmentSource::file);
        let cameras = self.session.cameras.as_ref().map(|cameras| cameras.path());
        let config = process.and_then(|process| process.config.as_deref());
        let inputs = [hdri, options.camera_file.as_deref(), config, cameras].into_iter().flatten().collect();
        let report = process.and_then(|process| process.report.as_deref());
        let ledger = process.and_then(|process| process.ledger.as_deref());
        self.session.neighbours.check(options)?;
        self.outputs.check_stdout(self.scenes.len(), report.is_some_and(is_stdout))?;
        let has_report = report.is_some();
        if process.is_some_and(|process| process.print_paths.is_some())
            && (self.outputs.is_stdout() || report.is_some_and(is_stdout))
        {
            let text = worded!("`print-paths`: standard output has the image or the page; name a file");
            return Err(UsageError(text));
        }
        let report = report.filter(|report| !is_stdout(report)).map(|report| ("report", report));
        if self.outputs.shards.is_some() && has_report {
            return Err(UsageError(worded!("`report`: it shows image files, not archives; remove it")));
        }
        if self.dry_run && self.outputs.shards.as_ref().is_some_and(|shards| shards.max_bytes().is_some()) {
            return Err(UsageError(worded!(
                "`dry-run`: the names of archives of limited bytes are not known before their images; set `shard-size` to \
                 a number of images"
            )));
        }
        if self.check.is_some() && (self.outputs.shards.is_some() || ledger.is_some()) {
            return Err(UsageError(worded!(
                "`check` compares all image files; remove `ledger`, and write no archives"
            )));
        }
        if self.session.dataset.is_some() {
            self.formats.check_outputs(&self.outputs, self.session.options.normalize.is_some())?;
        }
        let trace = process.and_then(|process| process.trace.as_deref()).map(|trace| ("trace", trace));
        let ledger = ledger.map(|ledger| ("ledger", ledger));
        let outputs = [report, ledger, trace].into_iter().flatten().collect();
        self.check_output_names(&OptionFiles { inputs, outputs })?;
        Ok(self)
    }
}

/// The share of `--chunk`: of the scenes of a batch, or of the frames of a single scene.
#[derive(Clone, Copy, Debug, Default)]
pub struct ScopedChunk {
    pub scenes: Option<Chunk>,
    pub frames: Option<Chunk>,
}

impl ScopedChunk {
    fn new(chunk: Option<Chunk>, scenes: &SceneList, is_sequence: bool) -> Result<Self, UsageError> {
        match chunk {
            Some(_) if scenes.is_batch() => Ok(ScopedChunk { scenes: chunk, frames: None }),
            Some(_) if !is_sequence => Err(UsageError(worded!(
                "`chunk`: there is only one image; add `frames` or `cameras`, or name several scenes, a list or a folder"
            ))),
            _ => Ok(ScopedChunk { scenes: None, frames: chunk }),
        }
    }

    /// Returns an error if several shares would write one archive.
    fn check_shards(&self, outputs: &Outputs) -> Result<(), UsageError> {
        let has_byte_limit = outputs.shards.as_ref().is_some_and(|shards| shards.max_bytes().is_some());
        match self.frames {
            Some(_) if outputs.shards.is_some() => Err(UsageError(worded!(
                "`chunk`: all frames of a scene are in one archive; name several scenes, a list or a folder"
            ))),
            _ if self.scenes.is_some() && has_byte_limit => Err(UsageError(worded!(
                "`chunk`: where an archive of limited bytes ends depends on all scenes before; set `shard-size` to \
                 a number of images"
            ))),
            _ => Ok(()),
        }
    }
}

fn build_settings() -> Result<AccelSettings, UsageError> {
    Ok(AccelSettings { simd: simd_level()?, ..Default::default() })
}
