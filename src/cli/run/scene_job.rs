//! The pictures of one scene, from its file to theirs.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result};

use crate::batch::{FileDigests, fingerprint, run_pipeline};
use crate::cli::console::print;
use crate::cli::plan::memory;
use crate::cli::plan::{Claims, Form, Job, Shot, Target, Writer};
use crate::cli::run::animation_writer::Reel;
use crate::cli::run::dataset::DatasetFile;
use crate::cli::run::progress::Teller;
use crate::cli::run::report::Report;
use crate::cli::run::session::{Moment, Studio};
use crate::import::{LoadOptions, load, open_scene_file};
use crate::output::{Picture, check_overwrite, check_writable, encode_thumbnail, save};
use crate::scene::{ClipBoundsCache, Scene, clip_duration};

/// What is to be done for one scene.
pub(crate) struct Work<'a> {
    pub job: &'a Job,
    /// Which scene, from 1.
    pub index: usize,
    pub path: &'a Path,
    pub teller: &'a Teller<'a>,
    pub report: Option<&'a mut Report>,
    /// What is in the files that pictures are made from.
    pub contents: FileDigests,
    /// Pictures that were there already.
    pub kept: usize,
}

impl Work<'_> {
    pub fn run(&mut self) -> Result<()> {
        // Whatever is there already need not be read.
        let known = self.job.shots.known().map(|shots| self.missing(shots));
        if self.job.dry_run {
            // Whatever is there may be a scene; what is not there is none.
            open_scene_file(self.path, memory::limits(self.job.max_memory).file_bytes)?;
        }
        let nothing_left = |shots: &[Shot]| shots.is_empty() && self.job.views.is_none();
        if let Some(shots) = known.as_ref().filter(|shots| nothing_left(shots) || self.job.dry_run) {
            return self.list(shots);
        }
        let scene = read(self.job, self.path, self.teller)?;
        // What was there is of other files if these were replaced since it was looked at.
        let agreed = self.contents.record(self.path, &scene.source);
        let shots = match known {
            Some(shots) if agreed => shots,
            _ => {
                let end = clip_duration(&scene, &self.job.look.animation(&scene)?)?;
                self.missing(self.job.shots.of(end)?)
            }
        };
        if self.job.dry_run {
            return self.list(&shots);
        }
        self.check_files(&scene, &shots)?;
        let mut clip_bounds_cache = ClipBoundsCache::default();
        if !shots.is_empty() {
            clip_bounds_cache = self.make(&scene, &shots)?;
        }
        // Pictures come first: where this file is, they are.
        if let Some(dataset) = self.dataset(&scene)
            && let Some(file) = dataset.write(&clip_bounds_cache)?
        {
            self.teller.reporter.wrote(Some(self.path), &file);
        }
        Ok(())
    }

    /// Refuses what could not be written in the end, or must not be, before anything is rendered.
    fn check_files(&mut self, scene: &Scene, shots: &[Shot]) -> Result<()> {
        let replace = self.job.outputs.replace;
        let claims = Claims::of_scene(self.path, scene.source.file_names());
        if let Some(report) = &mut self.report {
            report.spare(&claims)?;
        }
        let files = self.job.files(self.path, self.index, shots);
        for file in &files {
            claims.spare(file, Writer::Scene(self.path)).map_err(Error::msg)?;
        }
        self.check_overwrite(&files)?;
        if let Some(dataset) = self.dataset(scene) {
            dataset.check()?;
        }
        if let Some(first) = files.first() {
            folder_of(first)?;
            check_writable(first, replace)?;
        }
        Ok(())
    }

    fn dataset<'s>(&'s self, scene: &'s Scene) -> Option<DatasetFile<'s>> {
        let views = self.job.views.as_ref()?;
        Some(DatasetFile { job: self.job, views, scene, path: self.path, index: self.index })
    }

    /// Refuses files that are there and must stay. Of a dataset all shares write the same file.
    fn check_overwrite(&self, files: &[PathBuf]) -> Result<()> {
        let shared = self.job.views.map(|views| views.file(&self.job.outputs, self.path, self.index));
        let mut own = files.iter().filter(|file| Some(*file) != shared.as_ref());
        own.try_for_each(|file| Ok(check_overwrite(file, self.job.outputs.replace)?))
    }

    /// Makes the pictures: while one is rendered, the scene is posed and its trees are built for the
    /// next, and the one before is encoded and written. Gives what is known of the clip then.
    fn make(&mut self, scene: &Scene, shots: &[Shot]) -> Result<ClipBoundsCache> {
        let (path, reporter) = (self.path, self.teller.reporter);
        memory::check(self.job, scene, shots.len())?;
        reporter.frames(path, shots.len());
        let (studio, start) = Studio::new(self.job, scene, self.teller)?;
        let clip_bounds_cache = start.posed.clip_bounds_cache().clone();
        let mut reel = match (self.job.outputs.form, self.target(&shots[0])) {
            (Form::Moving(playing), Target::File(file)) => {
                Some(Reel::new(&file, &playing, studio.size(), self.job.outputs.replace)?)
            }
            _ => None,
        };
        let mut start = Some(start);
        run_pipeline(
            shots.len(),
            |i, before, spent| moment(&studio, shots[i].time, before, spent, &mut start),
            |i, moment| {
                let since = Instant::now();
                let watch = reporter.watch(path, studio.pixels());
                let picture = studio.picture(&shots[i], moment, &watch)?;
                watch.finish();
                Ok((picture, since.elapsed()))
            },
            |i, (picture, took)| {
                if let Some(reel) = &mut reel {
                    return self.add(reel, &picture, took);
                }
                let (key, target) = (self.job.key(&shots[i]), self.target(&shots[i]));
                // Standard output keeps nothing that could be asked for its fingerprint.
                let kept = target != Target::Stdout;
                let fingerprint = kept.then(|| fingerprint(key, path, &scene.source)).flatten();
                self.write(&Picture { fingerprint, ..picture }, &target, took)
            },
        )?;
        reel.map_or(Ok(()), |reel| self.publish(reel))?;
        Ok(clip_bounds_cache)
    }

    /// Adds a frame to a moving picture.
    fn add(&self, reel: &mut Reel, picture: &Picture, took: Duration) -> Result<()> {
        let start = Instant::now();
        reel.add(picture, took)?;
        self.teller.stage("encode", start, "");
        Ok(())
    }

    /// Makes a moving picture appear.
    fn publish(&mut self, reel: Reel) -> Result<()> {
        let start = Instant::now();
        let done = reel.finish()?;
        self.teller.stage("save", start, "");
        self.teller.reporter.wrote(Some(self.path), &done.file);
        if let Some(report) = &mut self.report {
            report.picture(&done.small, &done.file, done.took);
        }
        Ok(())
    }

    fn target(&self, shot: &Shot) -> Target {
        self.job.outputs.target(self.path, self.index, shot)
    }

    /// The pictures that are not there yet, as far as that was asked.
    fn missing(&mut self, mut shots: Vec<Shot>) -> Vec<Shot> {
        let (job, all) = (self.job, shots.len());
        if job.outputs.resume {
            shots.retain(|shot| {
                let target = job.outputs.target(self.path, self.index, shot);
                !job.outputs.has(&target, job.key(shot), self.path, &mut self.contents)
            });
            self.kept = all - shots.len();
            self.teller.reporter.kept(self.path, self.kept);
        }
        shots
    }

    /// With `--dry-run`: what would be written.
    fn list(&self, shots: &[Shot]) -> Result<()> {
        let files = self.job.files(self.path, self.index, shots);
        self.check_overwrite(&files)?;
        print(files.iter().map(|file| format!("{}\n", file.display())).collect::<String>().as_bytes())
    }

    /// Writes a finished picture.
    fn write(&mut self, picture: &Picture, target: &Target, took: Duration) -> Result<()> {
        let start = Instant::now();
        let outputs = &self.job.outputs;
        let Form::Pictures(format, depth) = outputs.form else { return Ok(()) };
        match target {
            Target::Stdout => {
                let bytes = format.encode(picture, depth).context("standard output")?;
                print(&bytes)?;
            }
            Target::File(file) => {
                folder_of(file)?;
                for written in save(picture, file, format, depth, outputs.replace)? {
                    self.teller.reporter.wrote(Some(self.path), &written);
                }
                if let Some(report) = &mut self.report {
                    report.picture(&encode_thumbnail(picture, Report::SIDE)?, file, took);
                }
            }
        }
        self.teller.stage("save", start, "");
        Ok(())
    }
}

/// Reads a scene, of which what is hidden is left out.
pub(crate) fn read(job: &Job, path: &Path, teller: &Teller) -> Result<Scene> {
    let start = Instant::now();
    let look = &job.look;
    let limits = memory::limits(job.max_memory);
    let (mut scene, warnings) = load(path, &LoadOptions { limits, ..look.load.clone() })?;
    let empty = scene.instances.is_empty();
    scene.select(&look.selection)?;
    teller.stage("load", start, &format!("{} triangles", scene.instanced_triangle_count()));
    for warning in &warnings {
        teller.warn(&warning.to_string())?;
    }
    if empty {
        teller.warn("it has nothing to draw: no node of the scene has a mesh of triangles")?;
    } else if scene.instances.is_empty() {
        teller.warn("--hide and --only-objects leave nothing to see")?;
    }
    Ok(scene)
}

/// The scene at `time`: as it was `before`, or at the clip's `start`, where nothing moves until then.
fn moment<'s>(
    studio: &Studio<'s>,
    time: f64,
    before: Option<&Arc<Moment<'s>>>,
    spent: Option<Arc<Moment<'s>>>,
    start: &mut Option<Moment<'s>>,
) -> Result<Arc<Moment<'s>>> {
    let made = match (before, start.take()) {
        (Some(before), _) if studio.is_at(before, time) => return Ok(before.clone()),
        (_, Some(mut start)) if studio.is_at(&start, time) => {
            studio.build(&mut start)?;
            start
        }
        // Trees that nobody looks at any more.
        (Some(before), _) => {
            studio.at(time, before, spent.and_then(Arc::into_inner).and_then(|m| m.accel))?
        }
        (None, Some(mut start)) => {
            let trees = start.accel.take();
            studio.at(time, &start, trees)?
        }
        (None, None) => unreachable!("the first moment comes out of the start"),
    };
    Ok(Arc::new(made))
}

/// Makes the folder of a file if it is missing.
pub(crate) fn folder_of(file: &Path) -> Result<()> {
    let Some(folder) = file.parent().filter(|f| !f.as_os_str().is_empty()) else { return Ok(()) };
    std::fs::create_dir_all(folder).with_context(|| format!("folder {} cannot be made", folder.display()))
}
