//! Renders one scene: from its file to its images.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result, bail};
use serde_json::json;

use super::animation_writer::AnimationWriter;
use super::dataset::TransformsFile;
use super::dataset_files::DatasetFiles;
use super::golden_check;
use super::imported_scene::{ImportedScene, NextScene};
use super::ledger::ImageCounts;
use super::progress::{ImageMonitor, SceneLog};
use super::report::{Report, THUMBNAIL_SIDE};
use crate::args::values::DatasetFormat;
use crate::console::print_stdout;
use crate::files::create_parent_folder;
use crate::plan::{OutputKind, PathConflicts, RenderPlan, Target, Writer};
use crate::scene_file::is_stdin;
use crate::watched_files::scene_files;
use blinn_core::cancellation::CancelToken;
use blinn_import::{is_in_archive, open_input_file, open_scene_file};
use blinn_output::datasets::{Dataset, DatasetView};
use blinn_output::{
    EncodedFile, SaveError, ShardWriter, check_overwrite, check_writable, encode_files, encode_thumbnail,
    save,
};
use blinn_scene::{ClipBoundsCache, Scene, clip_duration};
use blinn_session::ImageKind;
use blinn_session::{
    DatasetViews, EmptyImages, FileDigests, ImageCamera, PlannedFrame, PosedFrame, RenderedImage,
    SceneRenderer, SceneSetup, SessionLog, check_memory, fingerprint, load_limits, mark_empty, run_pipeline,
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
    pub report: Option<&'a mut Report>,
    /// The archive that images go into.
    pub shard: Option<&'a mut ShardWriter>,
    /// Digests of the files that images are made from.
    pub digests: FileDigests,
    /// All frames, once they are known, if images are compared with golden ones.
    pub frames: Vec<PlannedFrame>,
    pub images: ImageCounts,
    /// Ends the work on the scene.
    pub cancel: CancelToken,
    /// This scene, if it was read ahead.
    pub imported: Option<ImportedScene>,
    /// The scene to read while this one is rendered.
    pub next: Option<NextScene<'a>>,
    /// That scene, once it is read.
    pub imported_next: Option<ImportedScene>,
    /// Time in which nothing but that scene was worked on.
    pub waited: Duration,
    /// The images of a dataset that are known, by file name: true if they show something.
    pub views_shown: BTreeMap<String, bool>,
    /// Bounds over the clip, which all parts of the work share. Cancelled by `cancel`.
    pub clip_bounds: ClipBoundsCache,
    /// The files that the scene was made from, once it is read.
    pub scene_files: Vec<PathBuf>,
}

impl SceneJob<'_> {
    /// Renders what is missing, and compares it with golden images.
    pub fn run(&mut self) -> Result<()> {
        self.render_missing()?;
        let Some(check) = self.plan.check.as_ref().filter(|_| !self.plan.dry_run) else { return Ok(()) };
        let files = self.plan.output_files(self.path, self.index, &self.frames);
        let limits = load_limits(self.plan.session.max_memory);
        golden_check::check(check, self.path, &files, &limits, self.log.reporter)
    }

    fn render_missing(&mut self) -> Result<()> {
        // If all images are up to date, the scene need not be read.
        // The fingerprints of a dataset's images have cameras that depend on the scene.
        let needs_scene =
            self.plan.session.dataset.is_some() && self.plan.outputs.resume && self.shard.is_none();
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
        let imported = match self.imported.take() {
            Some(imported) => imported,
            None => ImportedScene::read(
                self.plan,
                self.path,
                load_limits(self.plan.session.max_memory),
                &self.cancel,
            )?,
        };
        let scene = imported.report(self.log)?;
        self.scene_files = scene_files(self.path, scene.source.file_names());
        // If a file was replaced after its hash was compared, compare again.
        let is_unchanged = self.digests.record(self.path, &scene.source);
        let plan = self.plan;
        let views = |dataset| DatasetViews::new(&plan.session, dataset, &scene, &self.clip_bounds);
        let views = plan.session.dataset.as_ref().map(views).transpose()?;
        let views = views.as_ref();
        let frames = match known {
            Some(frames) if is_unchanged => frames,
            _ => {
                let duration = clip_duration(&scene, &self.plan.session.options.animation(&scene)?)?;
                self.without_kept(self.plan.frames.resolve(duration)?, views)?
            }
        };
        if self.plan.dry_run {
            return self.list(&frames);
        }
        self.check_files(&scene, views, &frames)?;
        if frames.is_empty() {
            return self.write_files(&scene, views);
        }
        let memory_left = check_memory(&self.plan.session, &scene, frames.len())?;
        let next = self.next;
        let ((outcome, end), imported_next) = rayon::join(
            || {
                let outcome = self.render(&scene, views, &frames);
                let outcome = outcome.and_then(|()| self.write_files(&scene, views));
                (outcome, Instant::now())
            },
            || next.and_then(|next| next.read(plan, memory_left)),
        );
        self.imported_next = imported_next;
        self.waited = end.elapsed();
        outcome
    }

    /// Writes the files that describe all images.
    fn write_files(&self, scene: &Scene, views: Option<&DatasetViews>) -> Result<()> {
        let Some(transforms) = self.transforms_file(scene, views) else { return Ok(()) };
        for file in (DatasetFiles { transforms: &transforms, log: self.log }).write(&self.cancel)? {
            self.log.reporter.wrote(Some(self.path), &file);
        }
        // transforms.json comes last: if it exists, all images do.
        if self.plan.formats.has(DatasetFormat::Nerf)
            && let Some(file) = transforms.write(&self.views_shown)?
        {
            self.log.reporter.wrote(Some(self.path), &file);
        }
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
        // A list may have many cameras.
        for part in frames.chunks(FILES_AT_ONCE).chain([&frames[..0]]) {
            let files = self.plan.output_files(self.path, self.index, part);
            for file in &files {
                paths.check_not_input(file, Writer::Scene(self.path)).map_err(Error::msg)?;
            }
            self.check_not_kept(&files)?;
        }
        if let Some(transforms) = self.transforms_file(scene, views) {
            if self.plan.formats.has(DatasetFormat::Nerf) {
                transforms.check()?;
            }
            if let Some(file) = self.plan.formats.preferred_model(&transforms.file()) {
                let file = file.display();
                bail!(
                    "--dataset colmap: readers would prefer {file} to the text files; remove it or write colmap-bin"
                );
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
        let views = views.filter(|_| self.shard.is_none())?;
        Some(TransformsFile { plan: self.plan, views, scene, path: self.path, index: self.index })
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
    /// previous one is encoded and written.
    fn render(&mut self, scene: &Scene, views: Option<&DatasetViews>, frames: &[PlannedFrame]) -> Result<()> {
        let (path, reporter) = (self.path, self.log.reporter);
        reporter.begin_frames(path, frames.len());
        let (session, start) = SceneRenderer::new(
            &self.plan.session,
            scene,
            frames.len(),
            self.log,
            &self.clip_bounds,
            &self.cancel,
        )?;
        let mut animation = match (self.plan.outputs.kind, self.target(&frames[0])) {
            (OutputKind::Animation(output), Target::File(file)) => {
                let replace = self.plan.outputs.replace;
                Some(AnimationWriter::new(&file, &output, session.size(), replace)?)
            }
            _ => None,
        };
        let samples = match (&self.shard, views) {
            (Some(_), Some(views)) => {
                let SceneJob { plan, path, index, .. } = *self;
                Some(TransformsFile { plan, views, scene, path, index }.describe()?)
            }
            _ => None,
        };
        let mut start = Some(start);
        let empty_images = EmptyImages::default();
        let log = self.log;
        let cancel = self.cancel.clone();
        run_pipeline(
            frames.len(),
            |i, previous, finished| prepare(&session.setup, frames[i].time, previous, finished, &mut start),
            |i, posed_frame| {
                let since = Instant::now();
                let monitor = ImageMonitor::new(reporter, path, session.frame_pixels(&frames[i])?, &cancel);
                let image = session.render(&frames[i], posed_frame, &monitor)?;
                monitor.finish();
                if let Some(reason) = image.empty {
                    reporter.count_empty();
                    // With --strict, the first ends the scene.
                    let message = empty_images.add(reason, frames[i].number);
                    message.filter(|_| log.is_strict()).map_or(Ok(()), |notice| log.warn(notice))?;
                }
                Ok((image, since.elapsed()))
            },
            |i, (mut image, render_time)| {
                match &mut animation {
                    Some(animation) => self.add_to_animation(animation, &image, render_time)?,
                    None if self.shard.is_some() => {
                        self.add_to_shard(&frames[i], &mut image, scene, samples.as_ref())?;
                    }
                    None => self.write(&frames[i], &mut image, scene, render_time)?,
                }
                self.images.rendered += 1;
                self.images.empty += u64::from(image.empty.is_some());
                session.recycle(image);
                Ok(())
            },
        )?;
        if let Some(notice) = empty_images.summary(frames.len()) {
            log.warn(notice)?;
        }
        if let Some(animation) = animation {
            self.finish_animation(animation)?;
        }
        Ok(())
    }

    fn add_to_animation(
        &self,
        animation: &mut AnimationWriter,
        image: &RenderedImage,
        render_time: Duration,
    ) -> Result<()> {
        let start = Instant::now();
        animation.add(&image.picture, render_time)?;
        self.log.stage_since("encode", start, "");
        Ok(())
    }

    fn finish_animation(&mut self, animation: AnimationWriter) -> Result<()> {
        let start = Instant::now();
        let written = animation.finish()?;
        self.log.stage_since("save", start, "");
        self.images.files += 1;
        self.images.bytes += written.file.metadata().map_or(0, |file| file.len());
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
        views: Option<&DatasetViews>,
    ) -> Result<Vec<PlannedFrame>> {
        let plan = self.plan;
        if plan.check.is_some() {
            self.frames.clone_from(&frames);
        }
        let count = frames.len();
        // Archives are kept as a whole.
        if plan.outputs.resume && self.shard.is_none() {
            frames.retain(|frame| {
                let hash = match (views, &plan.session.cameras, frame.camera) {
                    (Some(views), ..) => views.view(frame).ok().map(|view| plan.view_hash(frame, &view)),
                    (None, Some(cameras), Some(index)) => {
                        cameras.camera(index).ok().map(|view| plan.view_hash(frame, &view))
                    }
                    _ => Some(plan.settings_hash(frame)),
                };
                // A camera that is not found is an error when its image is rendered.
                let Some(hash) = hash else { return true };
                let target = plan.outputs.target(self.path, self.index, frame);
                let kept = plan.outputs.up_to_date(&target, hash, self.path, &mut self.digests);
                if let Some(kept) = kept
                    && let Target::File(file) = &target
                {
                    self.add_view(file, !kept.is_empty);
                }
                kept.is_none()
            });
            let kept = count - frames.len();
            self.images.kept = kept as u64;
            self.log.reporter.kept(self.path, kept);
        }
        Ok(frames)
    }

    /// Notes for `transforms.json` if an image of a dataset shows something.
    fn add_view(&mut self, file: &Path, is_shown: bool) {
        if self.plan.session.dataset.is_some() {
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            self.views_shown.insert(name, is_shown);
        }
    }

    /// Prints the names of output files for --dry-run.
    fn list(&self, frames: &[PlannedFrame]) -> Result<()> {
        let files = self.plan.output_files(self.path, self.index, frames);
        self.check_not_kept(&files)?;
        let lines: String = files.iter().map(|file| format!("{}\n", file.display())).collect();
        print_stdout(lines.as_bytes())
    }

    /// Adds an image with its layers and its description to the archive.
    fn add_to_shard(
        &mut self,
        frame: &PlannedFrame,
        image: &mut RenderedImage,
        scene: &Scene,
        samples: Option<&(Dataset, Vec<DatasetView>)>,
    ) -> Result<()> {
        let start = Instant::now();
        let RenderedImage { picture, empty, view } = image;
        let OutputKind::Images(ImageKind { format, depth }) = self.plan.outputs.kind else { return Ok(()) };
        let Target::File(name) = self.target(frame) else { return Ok(()) };
        picture.fingerprint = image_fingerprint(self.plan, frame, *view, self.path, scene, empty.is_some());
        let hash = self.plan.member_hash(frame);
        let own_fingerprint = hash.and_then(|hash| fingerprint(hash, self.path, &scene.source));
        let mut description = json!({
            "scene": self.path.to_string_lossy(), "index": self.index, "frame": frame.number, "time": frame.time,
        });
        if let Some((dataset, views)) = samples
            && let Some(view) = usize::try_from(frame.number - 1).ok().and_then(|i| views.get(i))
        {
            dataset.describe_sample(view, &mut description);
        }
        if empty.is_some() {
            description["empty"] = json!(true);
        }
        description["fingerprint"] = json!(own_fingerprint);
        let description = EncodedFile {
            path: name.with_extension("json"),
            bytes: format!("{description:#}\n").into_bytes(),
        };
        let Some(shard) = &mut self.shard else { return Ok(()) };
        for file in encode_files(picture, &name, format, depth).chain([Ok(description)]) {
            let EncodedFile { path, bytes } = file?;
            let added = shard.add(&path.to_string_lossy(), &bytes);
            added.map_err(|cause| SaveError { path: shard.path().join(&path), cause })?;
            self.images.files += 1;
            self.images.bytes += bytes.len() as u64;
        }
        self.log.stage_since("save", start, "");
        Ok(())
    }

    /// Writes an image, with a fingerprint of what it was made from.
    fn write(
        &mut self,
        frame: &PlannedFrame,
        image: &mut RenderedImage,
        scene: &Scene,
        render_time: Duration,
    ) -> Result<()> {
        let start = Instant::now();
        let RenderedImage { picture, empty, view } = image;
        let is_empty = empty.is_some();
        let outputs = &self.plan.outputs;
        let OutputKind::Images(ImageKind { format, depth }) = outputs.kind else { return Ok(()) };
        match self.target(frame) {
            Target::Stdout => {
                let bytes = format.encode(picture, depth).context("standard output")?;
                print_stdout(&bytes)?;
            }
            Target::File(file) => {
                picture.fingerprint = image_fingerprint(self.plan, frame, *view, self.path, scene, is_empty);
                create_parent_folder(&file)?;
                for written in save(picture, &file, format, depth, outputs.replace)? {
                    self.images.files += 1;
                    self.images.bytes += written.metadata().map_or(0, |file| file.len());
                    self.log.reporter.wrote_image(Some(self.path), &written, is_empty);
                }
                if let Some(report) = &mut self.report {
                    let thumbnail = encode_thumbnail(picture, THUMBNAIL_SIDE)?;
                    report.add_image(&thumbnail, &file, render_time, is_empty);
                }
                self.add_view(&file, !is_empty);
            }
        }
        self.log.stage_since("save", start, "");
        Ok(())
    }
}

/// The fingerprint of an image in its file. `view` is its camera, `is_empty` says that it shows nothing.
pub fn image_fingerprint(
    plan: &RenderPlan,
    frame: &PlannedFrame,
    view: Option<ImageCamera>,
    path: &Path,
    scene: &Scene,
    is_empty: bool,
) -> Option<String> {
    let has_view = plan.session.dataset.is_some() || plan.session.cameras.is_some();
    let hash = match view.filter(|_| has_view) {
        Some(view) => plan.view_hash(frame, &view),
        None => plan.settings_hash(frame),
    };
    let fingerprint = fingerprint(hash, path, &scene.source)?;
    let is_marked = is_empty && plan.session.dataset.is_some();
    Some(if is_marked { mark_empty(&fingerprint) } else { fingerprint })
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
