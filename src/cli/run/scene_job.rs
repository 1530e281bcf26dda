//! Renders one scene: from its file to its images.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result};

use super::animation_writer::AnimationWriter;
use super::dataset::{DatasetViews, TransformsFile};
use super::dataset_files::DatasetFiles;
use super::empty_images::EmptyImages;
use super::golden_check;
use super::memory_estimate;
use super::posed_frame::{PosedFrame, SceneSetup};
use super::progress::{ImageMonitor, SceneLog};
use super::report::{Report, THUMBNAIL_SIDE};
use super::session::{RenderSession, RenderedImage};
use crate::batch::{FileDigests, fingerprint, run_pipeline};
use crate::cli::args::values::DatasetFormat;
use crate::cli::console::print_stdout;
use crate::cli::files::create_parent_folder;
use crate::cli::plan::{
    BackFaceCulling, OutputKind, PathConflicts, PlannedFrame, RenderPlan, Target, Writer, load_limits,
};
use crate::cli::scene_file::{is_stdin, load_scene_file};
use crate::import::{LoadOptions, open_scene_file};
use crate::output::{Picture, check_overwrite, check_writable, encode_thumbnail, save};
use crate::scene::{ClipBoundsCache, Scene, clip_duration};

/// Frames whose output files are checked at once.
const FILES_AT_ONCE: usize = 1024;

/// The work for one scene.
pub struct SceneJob<'a> {
    pub plan: &'a RenderPlan,
    /// The scene's number, from 1.
    pub index: usize,
    pub path: &'a Path,
    pub log: &'a SceneLog<'a>,
    pub report: Option<&'a mut Report>,
    /// Digests of the files that images are made from.
    pub digests: FileDigests,
    /// All frames, once they are known, if images are compared with golden ones.
    pub frames: Vec<PlannedFrame>,
    /// Number of images that --resume kept.
    pub kept: usize,
    /// The written images of a dataset, by file name: true if they show something.
    pub views_shown: BTreeMap<String, bool>,
}

impl SceneJob<'_> {
    /// Renders what is missing, and compares it with golden images.
    pub fn run(&mut self) -> Result<()> {
        self.render_missing()?;
        let Some(check) = self.plan.check.as_ref().filter(|_| !self.plan.dry_run) else { return Ok(()) };
        let files = self.plan.output_files(self.path, self.index, &self.frames);
        let limits = load_limits(self.plan.max_memory);
        golden_check::check(check, self.path, &files, &limits, self.log.reporter)
    }

    fn render_missing(&mut self) -> Result<()> {
        // If all images are up to date, the scene need not be read.
        // The fingerprints of a dataset's images have cameras that depend on the scene.
        let needs_scene = self.plan.dataset.is_some() && self.plan.outputs.resume;
        let known = self.plan.frames.known().filter(|_| !needs_scene);
        let known = known.map(|frames| self.without_kept(frames, None)).transpose()?;
        if self.plan.dry_run && !is_stdin(self.path) {
            // Checks that the file exists and may be a scene.
            open_scene_file(self.path, load_limits(self.plan.max_memory).file_bytes)?;
        }
        let is_done = |frames: &[PlannedFrame]| frames.is_empty() && self.plan.dataset.is_none();
        if let Some(frames) = known.as_ref().filter(|frames| is_done(frames) || self.plan.dry_run) {
            return self.list(frames);
        }
        let scene = load_scene(self.plan, self.path, self.log)?;
        // If a file was replaced after its hash was compared, compare again.
        let is_unchanged = self.digests.record(self.path, &scene.source);
        let frames = match known {
            Some(frames) if is_unchanged => frames,
            _ => {
                let duration = clip_duration(&scene, &self.plan.options.animation(&scene)?)?;
                self.without_kept(self.plan.frames.resolve(duration)?, Some(&scene))?
            }
        };
        if self.plan.dry_run {
            return self.list(&frames);
        }
        self.check_files(&scene, &frames)?;
        let clip_bounds =
            if frames.is_empty() { ClipBoundsCache::default() } else { self.render(&scene, &frames)? };
        if let Some(transforms) = self.transforms_file(&scene) {
            for file in (DatasetFiles { transforms: &transforms, log: self.log }).write(&clip_bounds)? {
                self.log.reporter.wrote(Some(self.path), &file);
            }
        }
        // transforms.json comes last: if it exists, all images do.
        if let Some(transforms) = self.transforms_file(&scene)
            && self.plan.formats.has(DatasetFormat::Nerf)
            && let Some(file) = transforms.write(&clip_bounds, &self.views_shown)?
        {
            self.log.reporter.wrote(Some(self.path), &file);
        }
        Ok(())
    }

    /// Checks before rendering that all files can be written, and that none is an input or has to be kept.
    fn check_files(&mut self, scene: &Scene, frames: &[PlannedFrame]) -> Result<()> {
        let paths = PathConflicts::with_scene(self.path, scene.source.file_names());
        if let Some(report) = &mut self.report {
            report.check_not_input(&paths)?;
        }
        // A list may have many cameras.
        for part in frames.chunks(FILES_AT_ONCE).chain([&frames[..0]]) {
            let files = self.plan.output_files(self.path, self.index, part);
            for file in &files {
                paths.check_not_input(file, Writer::Scene(self.path)).map_err(Error::msg)?;
            }
            self.check_not_kept(&files)?;
        }
        if let Some(transforms) = self.transforms_file(scene)
            && self.plan.formats.has(DatasetFormat::Nerf)
        {
            transforms.check()?;
        }
        let first = &frames[..frames.len().min(1)];
        if let Some(first) = self.plan.output_files(self.path, self.index, first).first() {
            create_parent_folder(first)?;
            check_writable(first, self.plan.outputs.replace)?;
        }
        Ok(())
    }

    fn transforms_file<'s>(&'s self, scene: &'s Scene) -> Option<TransformsFile<'s>> {
        let dataset = self.plan.dataset.as_ref()?;
        Some(TransformsFile { plan: self.plan, dataset, scene, path: self.path, index: self.index })
    }

    /// Returns an error if a file exists that --no-overwrite keeps. The files that describe all views are checked by their
    /// content, as all tasks of a farm write them.
    fn check_not_kept(&self, files: &[PathBuf]) -> Result<()> {
        let plan = self.plan;
        let shared = plan.dataset_files(self.path, self.index);
        let mut images = files.iter().filter(|file| !shared.contains(file));
        images.try_for_each(|file| Ok(check_overwrite(file, plan.outputs.replace)?))
    }

    /// Renders frames in a pipeline: while one frame is rendered, the next is posed and its BVH built, and the
    /// previous one is encoded and written. Returns the clip bounds that were found.
    fn render(&mut self, scene: &Scene, frames: &[PlannedFrame]) -> Result<ClipBoundsCache> {
        let (path, reporter) = (self.path, self.log.reporter);
        memory_estimate::check(self.plan, scene, frames.len())?;
        reporter.begin_frames(path, frames.len());
        let (session, start) = RenderSession::new(self.plan, scene, self.log)?;
        let clip_bounds = start.posed.clip_bounds_cache().clone();
        let mut animation = match (self.plan.outputs.kind, self.target(&frames[0])) {
            (OutputKind::Animation(output), Target::File(file)) => {
                let replace = self.plan.outputs.replace;
                Some(AnimationWriter::new(&file, &output, session.size(), replace)?)
            }
            _ => None,
        };
        let mut start = Some(start);
        let empty_images = EmptyImages::default();
        let log = self.log;
        run_pipeline(
            frames.len(),
            |i, previous, finished| prepare(&session.setup, frames[i].time, previous, finished, &mut start),
            |i, posed_frame| {
                let since = Instant::now();
                let monitor = ImageMonitor::new(reporter, path, session.frame_pixels(&frames[i])?);
                let image = session.render(&frames[i], posed_frame, &monitor)?;
                monitor.finish();
                if let Some(reason) = image.empty {
                    reporter.count_empty();
                    // With --strict, the first ends the scene.
                    let message = empty_images.add(reason, frames[i].number);
                    message.filter(|_| log.is_strict()).map_or(Ok(()), |text| log.warn(&text))?;
                }
                Ok((image, since.elapsed()))
            },
            |i, (image, render_time)| match &mut animation {
                Some(animation) => self.add_to_animation(animation, &image.picture, render_time),
                None => self.write(&frames[i], image, scene, render_time),
            },
        )?;
        if let Some(text) = empty_images.message(frames.len()) {
            log.warn(&text)?;
        }
        if let Some(animation) = animation {
            self.finish_animation(animation)?;
        }
        Ok(clip_bounds)
    }

    fn add_to_animation(
        &self,
        animation: &mut AnimationWriter,
        picture: &Picture,
        render_time: Duration,
    ) -> Result<()> {
        let start = Instant::now();
        animation.add(picture, render_time)?;
        self.log.stage("encode", start, "");
        Ok(())
    }

    fn finish_animation(&mut self, animation: AnimationWriter) -> Result<()> {
        let start = Instant::now();
        let written = animation.finish()?;
        self.log.stage("save", start, "");
        self.log.reporter.wrote(Some(self.path), &written.file);
        if let Some(report) = &mut self.report {
            report.add_image(&written.thumbnail, &written.file, written.render_time, false);
        }
        Ok(())
    }

    fn target(&self, frame: &PlannedFrame) -> Target {
        self.plan.outputs.target(self.path, self.index, frame)
    }

    /// Removes the frames that --resume keeps.
    fn without_kept(
        &mut self,
        mut frames: Vec<PlannedFrame>,
        scene: Option<&Scene>,
    ) -> Result<Vec<PlannedFrame>> {
        let plan = self.plan;
        if plan.check.is_some() {
            self.frames.clone_from(&frames);
        }
        let count = frames.len();
        if plan.outputs.resume {
            let views = match (&plan.dataset, scene) {
                (Some(dataset), Some(scene)) => {
                    Some(DatasetViews::new(plan, dataset, scene, &ClipBoundsCache::default())?)
                }
                _ => None,
            };
            frames.retain(|frame| {
                let hash = match (&views, &plan.cameras, frame.camera) {
                    (Some(views), ..) => views.view(frame).ok().map(|view| plan.view_hash(frame.time, &view)),
                    (None, Some(cameras), Some(index)) => {
                        cameras.camera(index).ok().map(|view| plan.view_hash(frame.time, &view))
                    }
                    _ => Some(plan.settings_hash(frame)),
                };
                // A camera that is not found is an error when its image is rendered.
                let Some(hash) = hash else { return true };
                let target = plan.outputs.target(self.path, self.index, frame);
                !plan.outputs.is_up_to_date(&target, hash, self.path, &mut self.digests)
            });
            self.kept = count - frames.len();
            self.log.reporter.kept(self.path, self.kept);
        }
        Ok(frames)
    }

    /// Prints the names of output files for --dry-run.
    fn list(&self, frames: &[PlannedFrame]) -> Result<()> {
        let files = self.plan.output_files(self.path, self.index, frames);
        self.check_not_kept(&files)?;
        let lines: String = files.iter().map(|file| format!("{}\n", file.display())).collect();
        print_stdout(lines.as_bytes())
    }

    /// Writes an image, with a fingerprint of what it was made from.
    fn write(
        &mut self,
        frame: &PlannedFrame,
        image: RenderedImage,
        scene: &Scene,
        render_time: Duration,
    ) -> Result<()> {
        let start = Instant::now();
        let RenderedImage { picture, empty, view } = image;
        let is_empty = empty.is_some();
        let outputs = &self.plan.outputs;
        let OutputKind::Images(format, depth) = outputs.kind else { return Ok(()) };
        match self.target(frame) {
            Target::Stdout => {
                let bytes = format.encode(&picture, depth).context("standard output")?;
                print_stdout(&bytes)?;
            }
            Target::File(file) => {
                let has_view = self.plan.dataset.is_some() || self.plan.cameras.is_some();
                let hash = match view.filter(|_| has_view) {
                    Some(view) => self.plan.view_hash(frame.time, &view),
                    None => self.plan.settings_hash(frame),
                };
                let fingerprint = fingerprint(hash, self.path, &scene.source);
                let picture = Picture { fingerprint, ..picture };
                create_parent_folder(&file)?;
                for written in save(&picture, &file, format, depth, outputs.replace)? {
                    self.log.reporter.wrote_image(Some(self.path), &written, is_empty);
                }
                if let Some(report) = &mut self.report {
                    let thumbnail = encode_thumbnail(&picture, THUMBNAIL_SIDE)?;
                    report.add_image(&thumbnail, &file, render_time, is_empty);
                }
                if self.plan.dataset.is_some() {
                    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
                    self.views_shown.insert(name, !is_empty);
                }
            }
        }
        self.log.stage("save", start, "");
        Ok(())
    }
}

/// Reads a scene and removes hidden objects.
pub fn load_scene(plan: &RenderPlan, path: &Path, log: &SceneLog) -> Result<Scene> {
    let start = Instant::now();
    let options = &plan.options;
    let limits = load_limits(plan.max_memory);
    let (mut scene, warnings) = load_scene_file(path, &LoadOptions { limits, ..options.load.clone() })?;
    let is_empty = scene.instances.is_empty();
    prepare_scene(plan, &mut scene)?;
    log.stage("load", start, &format!("{} triangles", scene.instanced_triangle_count()));
    log.warn_of_import(warnings)?;
    if is_empty {
        log.warn("nothing to render: no node of the scene has a mesh with triangles")?;
    } else if scene.instances.is_empty() {
        log.warn("nothing to render: --hide and --only-objects exclude all objects")?;
    }
    Ok(scene)
}

/// Removes hidden objects, and applies --cull back.
pub fn prepare_scene(plan: &RenderPlan, scene: &mut Scene) -> Result<()> {
    scene.select(&plan.options.selection)?;
    if plan.options.cull == BackFaceCulling::All {
        scene.materials.iter_mut().for_each(|material| material.double_sided = false);
    }
    Ok(())
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
