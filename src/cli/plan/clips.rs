//! Names of frames whose number is known only once scenes are read.

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use crate::cli::Usage;
use crate::cli::plan::memory;
use crate::cli::plan::{Claims, Form, Job, Shot, Writer};
use crate::import::{LoadOptions, load};
use crate::scene::clip_duration;

/// A frame that no clip has: where it stands in a name, a number does.
const MARK: i64 = i64::MAX;

impl Job {
    /// Refuses names that collide at some frame of a clip. Scenes are read for it where names differ by
    /// digits beside the frame's number alone, as `cube` and `cube1` do in `{stem}{frame}.png`.
    pub fn check_clips(&self) -> Result<(), Usage> {
        if self.shots.known().is_some() || matches!(self.outputs.form, Form::Moving(_)) {
            return Ok(());
        }
        let mut claims = Claims::default();
        for i in self.alike() {
            let scene = &self.scenes[i];
            // What cannot be read has no frames, and is told of when it is its turn.
            let Some(shots) = self.shots_of_file(scene) else { continue };
            for file in self.files(scene, i + 1, &shots) {
                claims.write(&file, Writer::Scene(scene)).map_err(Usage)?;
            }
        }
        Ok(())
    }

    /// Scenes of which two frames could have one name.
    fn alike(&self) -> BTreeSet<usize> {
        let mut by_name: HashMap<String, BTreeSet<usize>> = HashMap::new();
        for (i, scene) in self.scenes.iter().enumerate() {
            for file in self.files(scene, i + 1, &[Shot::at(MARK, 0.0)]) {
                by_name.entry(without_digits(&file)).or_default().insert(i);
            }
        }
        by_name.into_values().filter(|scenes| scenes.len() > 1).flatten().collect()
    }

    fn shots_of_file(&self, scene: &Path) -> Option<Vec<Shot>> {
        let limits = memory::limits(self.max_memory);
        let (scene, _) = load(scene, &LoadOptions { limits, ..self.look.load.clone() }).ok()?;
        self.shots.of(clip_duration(&scene, &self.look.animation(&scene).ok()?).ok()?).ok()
    }
}

/// A name without its frame's number, and without the digits that this could be taken together with.
fn without_digits(file: &Path) -> String {
    let (name, mark) = (file.to_string_lossy(), MARK.to_string());
    let parts = name.split(&mark).map(|part| part.trim_matches(|c: char| c.is_ascii_digit()));
    parts.collect::<Vec<_>>().join("#")
}
