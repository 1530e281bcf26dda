//! Renders one scene: from its file to its images.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Error, Result, bail};

use super::dataset::{TransformsFile, note_view};
use super::dataset_files::{DatasetFiles, SampleFiles, categories};
use super::frame_filter::FrameFilter;
use super::golden_check;
use super::image_sink::{AnimationSink, ArchiveSink, FileSink, ImageSink, SceneOutput, WrittenFiles};
use super::ledger::ImageCounts;
use super::load_scene::load_scene;
use super::progress::{ImageMonitor, SceneLog};
use super::report_section::ReportSection;
use crate::args::values::DatasetFormat;
use crate::console::print_stdout;
use crate::files::create_parent_folder;
use crate::plan::{
    ClipFrames, FrameSet, OutputKind, PathConflicts, RenderPlan, Target, Writer, frames_of_file,
};
use crate::scene_file::is_stdin;
use crate::watched_files::scene_files;
use blinn_core::cancellation::CancelToken;
use blinn_core::worded;
use blinn_import::{is_in_archive, open_input_file, open_scene_file};
use blinn_output::{ImageFormat, ShardPart, check_writable};
use blinn_scene::{ClipBoundsCache, Scene, clip_duration};
use blinn_session::{
    DatasetViews, EmptyImages, FileDigests, ImageKind, Notice, Permit, PlannedFrame, PosedFrame,
    SceneRenderer, SceneSetup, SessionLog, check_memory, load_limits, run_pipeline,
};

/// Frames whose output files are checked at once.
const FILES_AT_ONCE: usize = 1024;

/// The work for one scene.
pub struct SceneJob<'a> {
    pub plan: &'a RenderPlan,
    /// The scene's number, from 1.
    pub index: usize,
    pub path: &'a Path,
    pub log: &'a SceneLog<'a>,
    /// Its images on the page of --report.
    pub report: Option<&'a mut ReportSection>,
    /// The part of an archive that images go into.
    pub part: Option<&'a mut ShardPart>,
    /// Digests of the files that images are made from.
    pub digests: FileDigests,
    /// All frames, once they are known, if images are compared with golden ones.
    pub frames: Vec<PlannedFrame>,
    pub images: ImageCounts,
    /// Ends the work on the scene.
    pub cancel: CancelToken,
    /// The memory of the scene.
    pub permit: &'a Arc<Permit>,
    /// The images of a dataset that are known, by file name: true if they show something.
    pub views_shown: BTreeMap<String, bool>,
    /// Bounds over the clip, which all parts of the work share. Cancelled by `cancel`.
    pub clip_bounds: ClipBoundsCache,
    /// The files that the scene was made from, once it is read.
    pub scene_files: Vec<PathBuf>,
    /// The frames, if they depend on the scene, once they are known.
    pub clip: Option<ClipFrames>,
}

impl<'a> SceneJob<'a> {
    /// Renders what is missing, and compares it with golden images.
    pub fn run(&mut self) -> Result<()> {
        self.render_missing()?;
        let Some(check) = self.plan.check.as_ref().filter(|_| !self.plan.dry_run) else { return Ok(()) };
        let files = self.plan.output_files(self.path, self.index, &self.frames);
        let limits = load_limits(self.plan.session.max_memory);
        golden_check::check(check, &files, &limits, self.log)
    }

    fn render_missing(&mut self) -> Result<()> {
        // If all images are up to date, the scene need not be read.
        // The fingerprints of a dataset's images have cameras that depend on the scene.
        let needs_scene =
            self.plan.session.dataset.is_some() && self.plan.outputs.resume && self.part.is_none();
        let known = self.plan.frames.known().filter(|_| !needs_scene);
        let known = known.map(|frames| self.without_kept(frames, None)).transpose()?;
        if self.plan.dry_run && !is_stdin(self.path) {
            // Checks that the file exists and may be a scene.
            let limit = load_limits(self.plan.session.max_memory).file_bytes;
            if is_in_archive(self.path) {
                open_input_file(self.path, limit).with_context(|| self.path.display().to_string())?;
            } else {
                open_scene_file(self.path, limit)?;
            }
        }
        let is_done = |frames: &[PlannedFrame]| frames.is_empty() && self.plan.session.dataset.is_none();
        if let Some(frames) = known.as_ref().filter(|frames| is_done(frames) || self.plan.dry_run) {
            return self.list(frames);
        }
        let scene = load_scene(self.plan, self.path, self.log, self.permit, &self.cancel)?;
        self.scene_files = scene_files(self.path, scene.source.file_names());
        // If a file was replaced after its hash was compared, compare again.
        let is_unchanged = self.digests.record(self.path, &scene.source);
        let plan = self.plan;
        let views = |dataset| DatasetViews::new(&plan.session, dataset, &scene, &self.clip_bounds, self.log);
        let views = plan.session.dataset.as_ref().map(views).transpose()?;
        let views = views.as_ref();
        let frames = match known {
            Some(frames) if is_unchanged => frames,
            _ => {
                let duration = clip_duration(&scene, &self.plan.session.options.animation(&scene)?)?;
                if duration == 0.0 && matches!(plan.frames, FrameSet::Clip { .. }) {
                    self.log.hint(Notice::NothingMoves);
                }
                self.without_kept(self.plan.frames.resolve(duration, frames_of_file(&scene))?, views)?
            }
        };
        if self.plan.dry_run {
            return self.list(&frames);
        }
        self.check_files(&scene, views, &frames)?;
        if frames.is_empty() {
            return self.write_files(&scene, views);
        }
        let is_webp =
            matches!(plan.outputs.kind, OutputKind::Images(ImageKind { format: ImageFormat::Webp, .. }));
        let is_animation =
            frames.len() > 1 && plan.session.dataset.is_none() && plan.session.cameras.is_none();
        if is_webp && is_animation && plan.outputs.shards.is_none() && !plan.scenes.is_batch() {
            self.log.hint(Notice::SeparateWebps);
        }
        let memory = check_memory(&self.plan.session, &scene, frames.len())?;
        self.log.estimate(memory);
        let since = Instant::now();
        self.permit.resize(memory)?;
        self.log.trace("wait for memory", since.elapsed(), "");
        self.render(&scene, views, &frames)?;
        self.write_files(&scene, views)
    }

    /// Writes the files that describe all images.
    fn write_files(&mut self, scene: &Scene, views: Option<&DatasetViews>) -> Result<()> {
        let Some(views) = views else { return Ok(()) };
        let transforms = TransformsFile { plan: self.plan, views, scene, path: self.path, index: self.index };
        let dataset_files = DatasetFiles { transforms: &transforms, log: self.log };
        let mut files = Vec::new();
        if self.part.is_some() {
            files.extend(dataset_files.write_archive_models()?);
        } else {
            files.extend(dataset_files.write(&self.cancel)?);
            // transforms.json comes last: if it exists, all images do.
            if self.plan.formats.has(DatasetFormat::Nerf) {
                files.extend(transforms.write(&self.views_shown)?);
            }
        }
        let mut written = WrittenFiles::default();
        for file in files {
            self.log.wrote(&file);
            written.add_file(&file);
        }
        self.images.add(written);
        Ok(())
    }

    /// Checks before rendering that all files can be written, and that none is an input or has to be kept.
    fn check_files(
        &mut self,
        scene: &Scene,
        views: Option<&DatasetViews>,
        frames: &[PlannedFrame],
    ) -> Result<()> {
        let paths = PathConflicts::with_scene(self.path, scene.source.file_names());
        if let Some(report) = &mut self.report {
            report.check_not_input(&paths)?;
        }
        // A list may have many cameras. Without images, there are still the files that describe a dataset.
        let parts = if frames.is_empty() { vec![frames] } else { frames.chunks(FILES_AT_ONCE).collect() };
        for frames in parts {
            let files = self.plan.output_files(self.path, self.index, frames);
            for file in &files {
                paths.check_not_input(file, Writer::Scene(self.path)).map_err(Error::msg)?;
            }
            self.filter().check_not_kept(&files)?;
        }
        if let Some(transforms) = self.transforms_file(scene, views) {
            if self.plan.formats.coco_masks().is_some() {
                categories(self.plan, scene, self.path)?;
            }
            if self.plan.formats.has(DatasetFormat::Nerf) {
                transforms.check()?;
            }
            if let Some(file) =
                self.plan.dataset_folders(self.path, self.index).preferred_model(&self.plan.formats)
            {
                let file = file.display();
                bail!(worded!(
                    "`dataset` colmap: readers would prefer {} to the text files; remove it or write colmap-bin",
                    file
                ));
            }
        }
        let first = &frames[..frames.len().min(1)];
        if let Some(first) = self.plan.output_files(self.path, self.index, first).first() {
            create_parent_folder(first)?;
            check_writable(first, self.plan.outputs.replace)?;
        }
        Ok(())
    }

    /// The `transforms.json` of a dataset, unless its images go into an archive.
    fn transforms_file<'s>(
        &'s self,
        scene: &'s Scene,
        views: Option<&'s DatasetViews<'s>>,
    ) -> Option<TransformsFile<'s>> {
        let views = views.filter(|_| self.part.is_none())?;
        Some(TransformsFile { plan: self.plan, views, scene, path: self.path, index: self.index })
    }

    /// Renders frames in a pipeline: while one frame is rendered, the next is posed and its BVH built, and the
    /// previous one is encoded and written.
    fn render(&mut self, scene: &Scene, views: Option<&DatasetViews>, frames: &[PlannedFrame]) -> Result<()> {
        let sample_files = self.sample_files(scene, views)?;
        self.log.begin_frames(frames.len());
        let (renderer, start) = SceneRenderer::new(
            &self.plan.session,
            scene,
            frames.len(),
            self.log,
            &self.clip_bounds,
            &self.cancel,
        )?;
        let SceneJob { plan, index, path, log, .. } = *self;
        let output = SceneOutput { plan, scene, path, index, log };
        let report = self.report.as_deref_mut();
        let mut sink: Box<dyn ImageSink + Send> =
            match (plan.outputs.kind, output.target(&frames[0]), self.part.as_deref_mut()) {
                (OutputKind::Animation(animation), Target::File(file), _) => {
                    Box::new(AnimationSink::new(output, report, &animation, &file, renderer.size())?)
                }
                (_, _, Some(part)) => {
                    let dataset =
                        views.map(|views| TransformsFile { plan, views, scene, path, index }.describe());
                    Box::new(ArchiveSink { output, part, dataset: dataset.transpose()?, sample_files })
                }
                _ => Box::new(FileSink { output, report, views_shown: &mut self.views_shown }),
            };
        let images = &mut self.images;
        // Fingerprints are of the frames as they were planned, which are known before the file is read.
        let timed: Vec<PlannedFrame> = frames.iter().map(|frame| frame.in_scene(scene)).collect();
        let mut start = Some(start);
        let empty_images = EmptyImages::default();
        let cancel = &self.cancel;
        run_pipeline(
            frames.len(),
            |i, previous, finished| prepare(&renderer.setup, timed[i].time, previous, finished, &mut start),
            |i, posed_frame| {
                let since = Instant::now();
                let monitor = ImageMonitor::new(log, renderer.frame_pixels(&timed[i])?, cancel);
                let image = renderer.render(&timed[i], posed_frame, &monitor)?;
                monitor.finish();
                if let Some(reason) = image.empty {
                    log.count_empty();
                    // With --strict, the first ends the scene.
                    let message = empty_images.add(reason, frames[i].number);
                    message.filter(|_| log.is_strict()).map_or(Ok(()), |notice| log.warn(notice))?;
                }
                Ok((image, since.elapsed()))
            },
            |i, (mut image, render_time)| {
                images.add(sink.add(&frames[i], &mut image, render_time)?);
                images.rendered += 1;
                images.empty += u64::from(image.empty.is_some());
                renderer.recycle(image);
                Ok(())
            },
        )?;
        if let Some(notice) = empty_images.summary(frames.len()) {
            log.warn(notice)?;
        }
        images.add(sink.finish()?);
        Ok(())
    }

    /// The annotations that go into an archive, beside the images. They are made first, as the files of a sample stand together.
    fn sample_files(
        &self,
        scene: &Scene,
        views: Option<&DatasetViews>,
    ) -> Result<BTreeMap<i64, SampleFiles>> {
        let (Some(views), Some(_)) = (views, &self.part) else { return Ok(BTreeMap::new()) };
        let transforms = TransformsFile { plan: self.plan, views, scene, path: self.path, index: self.index };
        DatasetFiles { transforms: &transforms, log: self.log }.sample_files(&self.cancel)
    }

    fn filter(&self) -> FrameFilter<'a> {
        FrameFilter { plan: self.plan, path: self.path, index: self.index }
    }

    /// Removes the frames that --resume keeps.
    fn without_kept(
        &mut self,
        mut frames: Vec<PlannedFrame>,
        views: Option<&DatasetViews>,
    ) -> Result<Vec<PlannedFrame>> {
        let plan = self.plan;
        if let Some(chunk) = plan.chunk.frames.filter(|_| frames.is_empty()) {
            self.log.hint(Notice::EmptyShare(chunk));
        }
        if plan.check.is_some() {
            self.frames.clone_from(&frames);
        }
        self.clip = plan.frames.depend_on_scene().then(|| ClipFrames::of(&frames));
        // Scenes whose images in an archive are up to date are not started.
        if plan.outputs.resume && self.part.is_none() {
            let kept = self.filter().remove_kept(&mut frames, views, &mut self.digests);
            self.images.kept = kept.len() as u64;
            self.log.kept(kept.len());
            if plan.session.dataset.is_some() {
                kept.iter().for_each(|kept| note_view(&mut self.views_shown, &kept.file, !kept.is_empty));
            }
        }
        Ok(frames)
    }

    /// Prints the names of output files for --dry-run.
    fn list(&self, frames: &[PlannedFrame]) -> Result<()> {
        let files = self.plan.output_files(self.path, self.index, frames);
        self.filter().check_not_kept(&files)?;
        let lines: String = files.iter().map(|file| format!("{}\n", file.display())).collect();
        print_stdout(lines.as_bytes())
    }
}

/// The scene at `time`: the previous frame or the start of the clip if that shows the same, else posed anew with the
/// acceleration structure of a finished frame.
fn prepare<'s>(
    setup: &SceneSetup<'s>,
    time: f64,
    previous: Option<&Arc<PosedFrame<'s>>>,
    finished: Option<Arc<PosedFrame<'s>>>,
    start: &mut Option<PosedFrame<'s>>,
) -> Result<Arc<PosedFrame<'s>>> {
    let frame = match (previous, start.take()) {
        (Some(previous), _) if setup.is_at(previous, time) => return Ok(previous.clone()),
        (Some(previous), _) => {
            let reusable = finished.and_then(Arc::into_inner).and_then(|frame| frame.accel);
            setup.pose_at(time, previous, reusable)?
        }
        (None, Some(start)) => setup.frame_at(time, start)?,
        (None, None) => unreachable!("the first frame is posed from the start"),
    };
    Ok(Arc::new(frame))
}
