//! Conflicts between output names whose frame numbers are known only after reading the scenes.

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use super::path_conflicts::{PathConflicts, Writer};
use super::{OutputKind, PlannedFrame, RenderPlan, load_limits};
use crate::cli::usage::UsageError;
use crate::import::{LoadOptions, load};
use crate::scene::clip_duration;

/// A frame number that no clip has, to find its digits in a name.
const PLACEHOLDER: i64 = i64::MAX;

impl RenderPlan {
    /// Checks that no two frames of a clip have the same file. Only scenes whose names differ just by digits next to
    /// the frame number are read, such as `cube` and `cube1` in `{stem}{frame}.png`.
    pub fn check_clip_conflicts(&self) -> Result<(), UsageError> {
        if self.frames.known().is_some() || matches!(self.outputs.kind, OutputKind::Animation(_)) {
            return Ok(());
        }
        let mut paths = PathConflicts::default();
        for i in self.similar_scenes() {
            let scene = &self.scenes[i];
            // A scene that cannot be read has no frames. The error is reported when it is rendered.
            let Some(frames) = self.frames_of_file(scene) else { continue };
            for file in self.output_files(scene, i + 1, &frames) {
                paths.add_output(&file, Writer::Scene(scene)).map_err(UsageError)?;
            }
        }
        Ok(())
    }

    /// Indices of scenes that could have a frame with the same file as a frame of another scene.
    fn similar_scenes(&self) -> BTreeSet<usize> {
        let mut by_name: HashMap<String, BTreeSet<usize>> = HashMap::new();
        for (i, scene) in self.scenes.iter().enumerate() {
            for file in self.output_files(scene, i + 1, &[PlannedFrame::at(PLACEHOLDER, 0.0)]) {
                by_name.entry(without_frame_digits(&file)).or_default().insert(i);
            }
        }
        by_name.into_values().filter(|scenes| scenes.len() > 1).flatten().collect()
    }

    fn frames_of_file(&self, scene: &Path) -> Option<Vec<PlannedFrame>> {
        let limits = load_limits(self.max_memory);
        let (scene, _) = load(scene, &LoadOptions { limits, ..self.options.load.clone() }).ok()?;
        self.frames.resolve(clip_duration(&scene, &self.options.animation(&scene).ok()?).ok()?).ok()
    }
}

/// A name without the frame number and the digits next to it.
fn without_frame_digits(file: &Path) -> String {
    let name = file.to_string_lossy();
    let placeholder = PLACEHOLDER.to_string();
    let parts = name.split(&placeholder).map(|part| part.trim_matches(|c: char| c.is_ascii_digit()));
    parts.collect::<Vec<_>>().join("#")
}
