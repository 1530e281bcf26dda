//! The scenes of a finished archive, and whether their images are up to date.

use std::path::Path;

use serde_json::Value;

use super::dataset_files::has_bop_files;
use crate::args::values::DatasetFormat;
use crate::plan::{NumberedScene, RenderPlan, scene_of_key};
use blinn_output::read_shard;
use blinn_session::{FileDigests, PlannedFrame, load_limits};

/// A scene in an archive.
pub struct ArchivedScene {
    pub number: usize,
    /// Bytes of its files with their headers.
    pub bytes: u64,
    /// The key and the fingerprint of each sample.
    samples: Vec<(String, String)>,
}

/// Reads the scenes of an archive in order. `None` for anything but a complete archive.
pub fn archived_scenes(file: &Path) -> Option<Vec<ArchivedScene>> {
    let mut scenes: Vec<ArchivedScene> = Vec::new();
    let other = || std::io::Error::other("not an archive of samples");
    read_shard(file, is_description, |member| {
        let (key, _) = member.name.split_once('.').ok_or_else(other)?;
        let number = scene_of_key(key).ok_or_else(other)?;
        if scenes.last().is_none_or(|last| last.number != number) {
            scenes.push(ArchivedScene { number, bytes: 0, samples: Vec::new() });
        }
        let scene = scenes.last_mut().ok_or_else(other)?;
        scene.bytes += member.length;
        if is_description(member.name) {
            let sample: Value = serde_json::from_slice(member.bytes)?;
            let fingerprint = sample["fingerprint"].as_str().ok_or_else(other)?;
            scene.samples.push((key.to_string(), fingerprint.to_string()));
        }
        Ok(())
    })
    .ok()?;
    Some(scenes)
}

impl ArchivedScene {
    /// The keys of its samples.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.samples.iter().map(|(key, _)| key.as_str())
    }

    /// Returns true if the samples are those of a scene, made from the same files with the same settings, and what stands beside
    /// their archive exists.
    pub fn is_current(&self, plan: &RenderPlan, scene: &NumberedScene) -> bool {
        let Some(shards) = &plan.outputs.shards else { return false };
        let frames = plan.frames.known().unwrap_or_default();
        let mut digests = FileDigests::with_limit(load_limits(plan.session.max_memory).file_bytes);
        let mut is_same = |(frame, (key, fingerprint)): (&PlannedFrame, &(String, String))| {
            let hash = plan.member_hash(frame);
            *key == shards.sample_key(&scene.path, scene.number, frame.number)
                && hash.is_some_and(|hash| digests.is_current(fingerprint, hash, &scene.path))
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
