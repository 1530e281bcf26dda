//! Checks that no two outputs of a plan have the same name and that none is an input.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ffi::OsString;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use super::command_files::{NumberedScene, OptionFiles};
use super::dataset::check_folder;
use super::path_conflicts::{PathConflicts, Writer, differ_by_extension};
use super::{ArchiveFolder, FrameSet, MergedFolder, Outputs, RenderPlan, ShardPlan, Target};
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_import::has_tar_extension;
use blinn_session::PlannedFrame;

/// A frame number that no clip has, to find its digits in a name.
pub(super) const PLACEHOLDER: i64 = i64::MAX;

/// Number of output files up to which all are compared, also through links. Of more, only scenes whose names are
/// similar are compared: memory grows by 8 bytes a scene then.
const EXACT_FILES: usize = 20_000;

impl RenderPlan {
    /// Checks all names. If the number of frames is known only after reading a scene, its first frame is checked.
    pub(super) fn check_output_names(&self, options: &OptionFiles) -> Result<(), UsageError> {
        if let Some(shards) = &self.outputs.shards {
            return self.check_shard_names(shards, options);
        }
        let frames = match self.frames {
            // Their names were checked. Those of other scenes are alike.
            FrameSet::Cameras { .. } => {
                Some(vec![PlannedFrame { camera: Some(0), ..PlannedFrame::at(1, 0.0) }])
            }
            _ => self.frames.known().filter(|frames| !frames.is_empty()),
        };
        let frames = frames.unwrap_or_else(|| vec![PlannedFrame::at(1, 0.0)]);
        if let Some(dataset) = &self.session.dataset {
            for scene in self.numbered_scenes() {
                let NumberedScene { number, path } = scene?;
                check_folder(dataset, &path, number, &self.outputs)?;
                let folders = self.dataset_folders(&path, number);
                self.formats.check_names(dataset, &path, number, &self.outputs, &folders.colmap_images)?;
            }
            self.check_merged_folder()?;
        }
        let files = self.scenes.len().saturating_mul(frames.len());
        let scenes = if files <= EXACT_FILES {
            self.numbered_scenes().collect::<Result<Vec<_>, _>>()?
        } else {
            self.suspects(&frames[0], options)?
        };
        if self.session.dataset.is_some() {
            check_distinct(&scenes, &self.outputs)?;
        }
        if let Some(check) = &self.check {
            let mut images = Vec::new();
            for scene in self.numbered_scenes() {
                let NumberedScene { number, path } = scene?;
                images.extend(self.output_files(&path, number, &frames));
            }
            check.check_names(&images)?;
        }
        let inputs = scenes.iter().map(|scene| scene.path.as_path()).chain(options.inputs.iter().copied());
        let mut paths = PathConflicts::with_inputs(inputs);
        for NumberedScene { number, path } in &scenes {
            for file in self.output_files(path, *number, &frames) {
                paths.add_output(&file, Writer::Scene(path)).map_err(UsageError)?;
            }
        }
        for (option, file) in &options.outputs {
            paths.add_output(file, Writer::Option(option)).map_err(UsageError)?;
        }
        for file in self.merged_folder()?.iter().flat_map(|merged| merged.files(&self.formats)) {
            paths.add_output(&file, Writer::Option("merge")).map_err(UsageError)?;
        }
        Ok(())
    }

    /// Checks that the scenes of a merged dataset have one folder above theirs.
    fn check_merged_folder(&self) -> Result<(), UsageError> {
        let Some(merged) = self.merged_folder()? else { return Ok(()) };
        for scene in self.numbered_scenes() {
            let NumberedScene { number, path } = scene?;
            let other = MergedFolder::of(&self.outputs.transforms_file(&path, number), &self.formats)?;
            if other != merged {
                return Err(UsageError(worded!(
                    "`merge`: the images of {} would be outside {}; let scenes differ in one folder of `output` only",
                    path.display(),
                    merged.root.display()
                )));
            }
        }
        Ok(())
    }

    /// Checks that no archive is an input.
    fn check_shard_names(&self, shards: &ShardPlan, options: &OptionFiles) -> Result<(), UsageError> {
        let mut inputs: Vec<PathBuf> = options.inputs.iter().map(|file| file.to_path_buf()).collect();
        for scene in self.numbered_scenes() {
            let NumberedScene { path, .. } = scene?;
            let archive = path.ancestors().find(|ancestor| has_tar_extension(ancestor));
            if let Some(archive) = archive.filter(|archive| inputs.last().is_none_or(|last| last != archive))
            {
                inputs.push(archive.to_path_buf());
            }
        }
        let mut paths = PathConflicts::with_inputs(inputs);
        let count = shards.count(self.scenes.len());
        for shard in 0..count {
            let first = shards.scenes(shard..shard + 1, self.scenes.len()).start + 1;
            paths.add_output(&shards.file(first), Writer::Option("output")).map_err(UsageError)?;
        }
        for file in self.archive_folder().iter().flat_map(ArchiveFolder::files) {
            paths.add_output(&file, Writer::Option("dataset")).map_err(UsageError)?;
        }
        for (option, file) in &options.outputs {
            paths.add_output(file, Writer::Option(option)).map_err(UsageError)?;
        }
        Ok(())
    }

    /// All scenes with their numbers.
    pub fn numbered_scenes(&self) -> impl Iterator<Item = Result<NumberedScene, UsageError>> {
        self.scenes.iter().enumerate().map(|(i, path)| Ok(NumberedScene { number: i + 1, path: path? }))
    }

    /// The scenes that may have an output in common with another scene, or that an output may overwrite.
    fn suspects(
        &self,
        frame: &PlannedFrame,
        options: &OptionFiles,
    ) -> Result<Vec<NumberedScene>, UsageError> {
        let similar = self.similar_scenes()?;
        let numbers: HashSet<usize> = similar.iter().map(|scene| scene.number).collect();
        let extension = |path: &Path| path.extension().map(|e| e.to_ascii_lowercase());
        let mut written: BTreeSet<OsString> = BTreeSet::new();
        let mut suspects = similar;
        for scene in self.numbered_scenes() {
            let scene = scene?;
            if scene.number == 1 {
                let files = self.output_files(&scene.path, 1, std::slice::from_ref(frame));
                written.extend(files.iter().filter_map(|file| extension(file)));
            }
            let is_written = extension(&scene.path).is_some_and(|e| written.contains(&e))
                || options.outputs.iter().any(|(_, file)| *file == scene.path);
            if is_written && !numbers.contains(&scene.number) {
                suspects.push(scene);
            }
        }
        Ok(suspects)
    }

    /// The scenes that could have a file with the same name as a file of another scene, whatever their frames.
    pub(super) fn similar_scenes(&self) -> Result<Vec<NumberedScene>, UsageError> {
        let mut keys = Vec::new();
        for scene in self.numbered_scenes() {
            let NumberedScene { number, path } = scene?;
            keys.push(self.name_key(&path, number));
        }
        let mut sorted = keys.clone();
        sorted.sort_unstable();
        let equal = sorted.windows(2).filter(|pair| pair[0] == pair[1]);
        let repeated: HashSet<u64> = equal.map(|pair| pair[0]).collect();
        if repeated.is_empty() {
            return Ok(Vec::new());
        }
        let is_similar = |scene: &Result<NumberedScene, UsageError>| match scene {
            Ok(scene) => repeated.contains(&keys[scene.number - 1]),
            Err(_) => true,
        };
        self.numbered_scenes().filter(is_similar).collect()
    }

    /// A hash that is equal for scenes that may have an output in common.
    fn name_key(&self, scene: &Path, number: usize) -> u64 {
        let mut hasher = DefaultHasher::new();
        if self.session.dataset.is_some() {
            self.dataset_folders(scene, number).shared_path(&self.formats).hash(&mut hasher);
        } else if let Target::File(file) =
            self.outputs.target(scene, number, &PlannedFrame::at(PLACEHOLDER, 0.0))
        {
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            // Previews of layers differ after the first dot.
            let stem = name.split('.').next().unwrap_or_default();
            without_frame_digits(&file.with_file_name(stem)).hash(&mut hasher);
        }
        hasher.finish()
    }
}

/// A name without the frame number and the digits next to it.
fn without_frame_digits(file: &Path) -> String {
    let name = file.to_string_lossy();
    let placeholder = PLACEHOLDER.to_string();
    let parts = name.split(&placeholder).map(|part| part.trim_matches(|c: char| c.is_ascii_digit()));
    parts.collect::<Vec<_>>().join("#")
}

/// Checks that no two datasets share a folder.
fn check_distinct(scenes: &[NumberedScene], outputs: &Outputs) -> Result<(), UsageError> {
    let mut transforms_files: HashMap<PathBuf, &PathBuf> = HashMap::new();
    for NumberedScene { number, path } in scenes {
        let transforms = outputs.transforms_file(path, *number);
        if let Some(other) = transforms_files.insert(transforms.clone(), path) {
            let folder = transforms.parent().filter(|folder| !folder.as_os_str().is_empty());
            return Err(UsageError(worded!(
                "{} and {} would both write their dataset to {}; let their folders differ, as in `output` '{}/####.png'",
                other.display(),
                path.display(),
                folder.unwrap_or(Path::new(".")).display(),
                differing_placeholder(path, other)
            )));
        }
    }
    Ok(())
}

/// The placeholder of a folder's name that differs between two scenes.
fn differing_placeholder(a: &Path, b: &Path) -> &'static str {
    let folder = |path: &Path| path.parent().and_then(Path::file_name).map(OsString::from);
    match () {
        () if differ_by_extension(a, b) => "{stem}.{ext}",
        () if a.file_stem() != b.file_stem() => "{stem}",
        () if folder(a) != folder(b) => "{parent}",
        () => "{index:05}",
    }
}
