//! A finished archive, its scenes, and whether their images are up to date.

use std::fs::File;
use std::io::{self, ErrorKind};
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;

use super::dataset_files::has_bop_files;
use crate::args::values::DatasetFormat;
use crate::plan::{NumberedScene, RenderPlan, scene_of_key};
use blinn_output::read_shard;
use blinn_session::{FileDigests, PlannedFrame, SettingsHash, has_settings, load_limits};

/// An archive of an earlier run. It is open, so that its images can be copied after it was replaced.
pub struct ArchivedShard {
    pub path: PathBuf,
    pub file: File,
    /// Its scenes, at least one, by their numbers.
    pub scenes: Vec<ArchivedScene>,
}

/// A scene in an archive.
pub struct ArchivedScene {
    pub number: usize,
    /// The bytes of its files with their headers.
    pub members: Range<u64>,
    /// The key and the fingerprint of each sample.
    samples: Vec<(String, String)>,
}

impl ArchivedShard {
    /// Opens an archive. `None` for anything but a complete archive of samples.
    ///
    /// # Errors
    /// The file exists and cannot be read: nothing is known about its images.
    pub fn open(path: &Path) -> Result<Option<ArchivedShard>> {
        // A pipe would be read.
        if !path.is_file() {
            return Ok(None);
        }
        let opened = File::open(path).and_then(|file| Ok((read_scenes(&file)?, file)));
        match opened {
            Ok((scenes, _)) if scenes.is_empty() => Ok(None),
            Ok((scenes, file)) => Ok(Some(ArchivedShard { path: path.to_path_buf(), file, scenes })),
            Err(error) if is_of_content(&error) => Ok(None),
            Err(error) => Err(error).with_context(|| format!("{} cannot be read", path.display())),
        }
    }

    /// The number of its last scene.
    pub fn last_number(&self) -> usize {
        self.scenes.last().map_or(0, |scene| scene.number)
    }

    /// Bytes of its files with their headers.
    pub fn length(&self) -> u64 {
        self.scenes.last().map_or(0, |scene| scene.members.end)
    }
}

/// Reads the scenes of an archive in order.
fn read_scenes(file: &File) -> io::Result<Vec<ArchivedScene>> {
    let mut scenes: Vec<ArchivedScene> = Vec::new();
    let other = || io::Error::other("not an archive of samples");
    read_shard(file, is_description, |member| {
        let (key, _) = member.name.split_once('.').ok_or_else(other)?;
        let number = scene_of_key(key).ok_or_else(other)?;
        let start = scenes.last().map_or(0, |last| last.members.end);
        if scenes.last().is_none_or(|last| last.number < number) {
            scenes.push(ArchivedScene { number, members: start..start, samples: Vec::new() });
        }
        // The files of a scene stand together, with nothing between them.
        let is_next = |scene: &&mut ArchivedScene| scene.number == number && member.start == start;
        let scene = scenes.last_mut().filter(is_next).ok_or_else(other)?;
        scene.members.end = start.checked_add(member.length).ok_or_else(other)?;
        if is_description(member.name) {
            let sample: Value = serde_json::from_slice(member.bytes)?;
            let fingerprint = sample["fingerprint"].as_str().ok_or_else(other)?;
            scene.samples.push((key.to_string(), fingerprint.to_string()));
        }
        Ok(())
    })?;
    Ok(scenes)
}

/// Returns true for the error of a malformed or torn archive, in contrast to those of the system.
fn is_of_content(error: &io::Error) -> bool {
    use ErrorKind::{InvalidData, InvalidInput, Other, UnexpectedEof};
    matches!(error.kind(), InvalidData | InvalidInput | Other | UnexpectedEof)
}

impl ArchivedScene {
    /// Number of its images.
    pub fn images(&self) -> u64 {
        self.samples.len() as u64
    }

    /// The keys of its samples.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.samples.iter().map(|(key, _)| key.as_str())
    }

    /// Returns true if the samples are those of a scene, made with the same settings, whatever its files are now, and what
    /// stands beside their archive exists.
    pub fn has_settings(&self, plan: &RenderPlan, scene: &NumberedScene) -> bool {
        self.is_of(plan, scene, has_settings)
    }

    /// Returns true if the samples are those of a scene, made from the same files with the same settings, and what stands beside
    /// their archive exists.
    pub fn is_current(&self, plan: &RenderPlan, scene: &NumberedScene) -> bool {
        let mut digests = FileDigests::with_limit(load_limits(plan.session.max_memory).file_bytes);
        self.is_of(plan, scene, |fingerprint, hash| digests.is_current(fingerprint, hash, &scene.path))
    }

    /// Returns true if the samples are those of a scene, `accepts` their fingerprints, and what stands beside their archive
    /// exists.
    fn is_of(
        &self,
        plan: &RenderPlan,
        scene: &NumberedScene,
        mut accepts: impl FnMut(&str, SettingsHash) -> bool,
    ) -> bool {
        let Some(shards) = &plan.outputs.shards else { return false };
        let plan = &*plan.of_scene(&scene.path);
        let frames = plan.frames.known().unwrap_or_default();
        let mut is_same = |(frame, (key, fingerprint)): (&PlannedFrame, &(String, String))| {
            *key == shards.sample_key(&scene.path, scene.number, frame.number)
                && plan.member_hash(frame).is_some_and(|hash| accepts(fingerprint, hash))
        };
        self.number == scene.number
            && self.samples.len() == frames.len()
            && frames.iter().zip(&self.samples).all(&mut is_same)
            && (!plan.formats.has(DatasetFormat::Bop)
                || has_bop_files(plan, &scene.path, scene.number, &frames))
    }
}

/// Returns true for the description of a sample.
fn is_description(name: &str) -> bool {
    name.split_once('.').is_some_and(|(_, extension)| extension == "json")
}
