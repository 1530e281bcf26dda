//! The pictures of one scene, from its file to theirs.

use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use anyhow::{Context, Result};

use super::job::{Job, Shot, Target};
use super::progress::Teller;
use super::report::Report;
use super::studio::{Moment, Studio};
use crate::batch::{Contents, overlap, written_since};
use crate::import::load;
use crate::output::{Format, Picture, check_writable, save};
use crate::scene::{Scene, Selection, clip_end};

/// What is to be done for one scene.
pub(super) struct Work<'a> {
    pub job: &'a Job,
    /// Which scene, from 1.
    pub index: usize,
    pub path: &'a Path,
    pub teller: &'a Teller<'a>,
    pub report: Option<&'a mut Report>,
    /// What is in the files that pictures are made from.
    pub contents: Contents,
    /// Pictures that were there already.
    pub kept: usize,
}

impl Work<'_> {
    pub fn run(&mut self) -> Result<()> {
        let begun = SystemTime::now();
        // Whatever is there already need not be read.
        let known = self.job.shots.known().map(|shots| self.missing(shots));
        if let Some(shots) = known.as_ref().filter(|shots| shots.is_empty() || self.job.dry_run) {
            return self.list(shots);
        }
        let scene = self.read()?;
        let shots = match known {
            Some(shots) => shots,
            None => {
                let end = clip_end(&scene, &self.job.look.animation(&scene)?)?;
                self.missing(self.job.shots.of(end))
            }
        };
        if shots.is_empty() || self.job.dry_run {
            return self.list(&shots);
        }
        // A folder that nothing can be written to is found before anything is rendered.
        if let Target::File(file) = self.target(&shots[0]) {
            folder_of(&file)?;
            check_writable(&file, self.job.outputs.replace)?;
        }
        // A picture of files that changed meanwhile is of neither what they were nor what they are.
        let certain = !written_since(begun, self.path, &scene.source.files);
        self.make(&scene, &shots, certain)
    }

    /// Makes the pictures: while one is rendered, the scene is posed and its trees are built for the
    /// next, and the one before is encoded and written.
    fn make(&mut self, scene: &Scene, shots: &[Shot], certain: bool) -> Result<()> {
        let (path, reporter) = (self.path, self.teller.reporter);
        reporter.frames(path, shots.len());
        let (studio, start) = Studio::new(self.job, scene, self.teller)?;
        let mut start = Some(start);
        overlap(
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
                let (key, target) = (self.job.key(&shots[i]), self.target(&shots[i]));
                // Standard output keeps nothing that could be asked for its stamp.
                let stamped = certain && target != Target::Stdout;
                let stamp = stamped.then(|| self.contents.stamp(key, path, &scene.source.files));
                self.write(&Picture { stamp, ..picture }, &target, took)
            },
        )
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
        let mut out = std::io::stdout().lock();
        for file in shots.iter().flat_map(|shot| self.job.outputs.files(&self.target(shot))) {
            // A closed pipe is no error.
            let _ = writeln!(out, "{}", file.display());
        }
        Ok(())
    }

    fn read(&self) -> Result<Scene> {
        let start = Instant::now();
        let Job { look, .. } = self.job;
        let (mut scene, warnings) = load(self.path, &look.load)?;
        scene.select(&look.selection)?;
        self.teller.stage("load", start, &format!("{} triangles", scene.drawn_triangles()));
        for warning in &warnings {
            self.teller.warn(&warning.to_string())?;
        }
        if scene.instances.is_empty() && look.selection != Selection::default() {
            self.teller.warn("--hide and --only-objects leave nothing to see")?;
        }
        Ok(scene)
    }

    /// Writes a finished picture.
    fn write(&mut self, picture: &Picture, target: &Target, took: Duration) -> Result<()> {
        let start = Instant::now();
        let outputs = &self.job.outputs;
        match target {
            Target::Stdout => {
                let bytes = Format::Png.encode(picture, outputs.depth).context("standard output")?;
                match std::io::stdout().lock().write_all(&bytes) {
                    Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => {}
                    other => other.context("standard output")?,
                }
            }
            Target::File(file) => {
                folder_of(file)?;
                for written in save(picture, file, outputs.format, outputs.depth, outputs.replace)? {
                    self.teller.reporter.wrote(&written);
                }
                if let Some(report) = &mut self.report {
                    report.picture(picture, file, took)?;
                }
            }
        }
        self.teller.stage("save", start, "");
        Ok(())
    }
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
fn folder_of(file: &Path) -> Result<()> {
    let Some(folder) = file.parent().filter(|f| !f.as_os_str().is_empty()) else { return Ok(()) };
    std::fs::create_dir_all(folder).with_context(|| format!("folder {} cannot be made", folder.display()))
}
