//! `--views`: pictures from all around, for whoever makes models out of pictures.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use crate::batch::WorldUp;
use crate::cli::Usage;
use crate::cli::args::{TurntableArgs, UpArg};
use crate::cli::plan::{Look, Outputs, Shot, Target, animation};
use crate::integrator::Aov;
use crate::scene::{Orbit, Projection};

/// The views of a dataset.
#[derive(Clone, Copy, Debug)]
pub struct Views {
    pub count: u32,
    /// The moment that they show, in seconds.
    pub time: f64,
    pub up: WorldUp,
}

/// Layers that every dataset has.
const LAYERS: [Aov; 3] = [Aov::Depth, Aov::Normal, Aov::Mask];
/// Where pictures were taken from.
const FILE: &str = "transforms.json";

/// A view of a dataset.
pub fn shot(frame: i64, count: u32, time: f64) -> Shot {
    let orbit = Orbit::fibonacci_sphere(u32::try_from(frame - 1).unwrap_or_default(), count);
    Shot { orbit: Some(orbit), ..Shot::at(frame, time) }
}

impl Views {
    /// Puts the camera of `look` around the scene, and adds the layers.
    pub fn new(count: u32, args: &TurntableArgs, look: &mut Look) -> Result<Views, Usage> {
        if look.view.projection == Some(Projection::Orthographic) {
            return Err(Usage(format!(
                "--views: {FILE} knows perspective cameras alone: leave orthographic out"
            )));
        }
        if args.output.output.as_deref().and_then(animation::format).is_some() {
            return Err(Usage(
                "--views: a dataset is of single pictures: write .png, .jpg, .webp or .exr".into(),
            ));
        }
        look.view.projection = Some(Projection::Perspective);
        look.view.orbit = Some(Orbit::fibonacci_sphere(0, count));
        for aov in LAYERS {
            if !look.layers.aovs.contains(&aov) {
                look.layers.aovs.push(aov);
            }
        }
        let up = match args.turn.nerf_up {
            Some(UpArg::Y) => WorldUp::Y,
            Some(UpArg::Z) | None => WorldUp::Z,
        };
        Ok(Views { count, time: args.moment.time.unwrap_or(0.0), up })
    }

    /// All of them, whichever share of them is rendered.
    pub fn shots(&self) -> impl Iterator<Item = Shot> {
        let Views { count, time, .. } = *self;
        (1..=i64::from(count)).map(move |frame| shot(frame, count, time))
    }

    /// The file that says where a scene's pictures were taken from: it lies beside them.
    pub fn file(&self, outputs: &Outputs, scene: &Path, index: usize) -> PathBuf {
        match outputs.target(scene, index, &shot(1, self.count, self.time)) {
            Target::File(picture) => picture.with_file_name(FILE),
            Target::Stdout => FILE.into(),
        }
    }

    /// Refuses pictures that do not lie together, and datasets that do.
    pub fn check_names(&self, scenes: &[PathBuf], outputs: &Outputs) -> Result<(), Usage> {
        let mut taken: HashMap<PathBuf, &PathBuf> = HashMap::new();
        for (i, scene) in scenes.iter().enumerate() {
            let file = self.file(outputs, scene, i + 1);
            let last = outputs.target(scene, i + 1, &shot(i64::from(self.count), self.count, self.time));
            if !matches!(&last, Target::File(last) if last.parent() == file.parent()) {
                return Err(Usage(
                    "--views: pictures of a dataset lie in one folder: number them by name".into(),
                ));
            }
            if let Target::File(picture) = &last
                && picture.file_name().is_some_and(|name| name.to_str().is_none())
            {
                return Err(Usage(format!(
                    "--views: {FILE} names pictures in UTF-8 text, and {} is none: name them with -o",
                    picture.display()
                )));
            }
            if let Some(other) = taken.insert(file.clone(), scene) {
                return Err(Usage(format!(
                    "{} and {} would both have their {}: use {{stem}}/ in -o",
                    other.display(),
                    scene.display(),
                    file.display()
                )));
            }
        }
        Ok(())
    }
}
