//! Conflicts between output names whose frame numbers are known only after reading the scenes.

use std::path::Path;

use super::command_files::NumberedScene;
use super::path_conflicts::{PathConflicts, Writer};
use super::{OutputKind, RenderPlan, frames_of_file};
use crate::usage::UsageError;
use blinn_import::LoadOptions;
use blinn_scene::clip_duration;
use blinn_session::{PlannedFrame, load_scene};

impl RenderPlan {
    /// Checks that no two frames of a clip have the same file. Only scenes whose names differ just by digits next to
    /// the frame number are read, such as `cube` and `cube1` in `{stem}{frame}.png`.
    pub fn check_clip_conflicts(&self) -> Result<(), UsageError> {
        if self.frames.known().is_some() || matches!(self.outputs.kind, OutputKind::Animation(_)) {
            return Ok(());
        }
        let similar = self.similar_scenes()?;
        let mut paths = PathConflicts::default();
        for NumberedScene { number, path } in &similar {
            // A scene that cannot be read has no frames. The error is reported when it is rendered.
            let Some(frames) = self.frames_of_file(path) else { continue };
            for file in self.output_files(path, *number, &frames) {
                paths.add_output(&file, Writer::Scene(path)).map_err(UsageError)?;
            }
        }
        Ok(())
    }

    fn frames_of_file(&self, scene: &Path) -> Option<Vec<PlannedFrame>> {
        let limits = self.session.scene_limits();
        let options = LoadOptions { limits, ..self.session.options.load.clone() };
        let (scene, _) = load_scene(scene, &options, self.session.options.blender.as_deref()).ok()?;
        let duration = clip_duration(&scene, &self.session.options.animation(&scene).ok()?).ok()?;
        self.frames.resolve(duration, frames_of_file(&scene)).ok()
    }
}
