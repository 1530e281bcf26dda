//! `turntable --views`: views from all around a scene, as a training set for NeRF and Gaussian splatting.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::animation_output::animation_format;
use super::frames::PlannedFrame;
use super::outputs::{Outputs, Target};
use super::render_options::RenderOptions;
use crate::batch::WorldUp;
use crate::cli::args::{TurntableArgs, UpArg};
use crate::cli::usage::UsageError;
use crate::integrator::Aov;
use crate::scene::{Orbit, Projection};

/// The views of a dataset.
#[derive(Clone, Copy, Debug)]
pub struct DatasetPlan {
    pub count: u32,
    /// Time of all views in the animation, in seconds.
    pub time: f64,
    pub up: WorldUp,
}

/// AOVs that every dataset has.
const AOVS: [Aov; 3] = [Aov::Depth, Aov::Normal, Aov::Mask];
/// The file with the cameras of all views.
const TRANSFORMS: &str = "transforms.json";

/// View number `frame` of `count`, evenly distributed on a sphere.
pub fn view_frame(frame: i64, count: u32, time: f64) -> PlannedFrame {
    let orbit = Orbit::fibonacci_sphere(u32::try_from(frame - 1).unwrap_or_default(), count);
    PlannedFrame { orbit: Some(orbit), ..PlannedFrame::at(frame, time) }
}

impl DatasetPlan {
    /// Resolves a dataset. Sets projection, orbit and AOVs in `options`.
    pub fn new(
        count: u32,
        args: &TurntableArgs,
        options: &mut RenderOptions,
    ) -> Result<DatasetPlan, UsageError> {
        if options.view.projection == Some(Projection::Orthographic) {
            return Err(UsageError(format!(
                "--views: {TRANSFORMS} supports only perspective cameras; remove the orthographic projection"
            )));
        }
        if args.output.output.as_deref().and_then(animation_format).is_some() {
            let text = "--views: a dataset consists of images; set -o to .png, .jpg, .webp or .exr";
            return Err(UsageError(text.into()));
        }
        options.view.projection = Some(Projection::Perspective);
        options.view.orbit = Some(Orbit::fibonacci_sphere(0, count));
        for aov in AOVS {
            if !options.aovs.aovs.contains(&aov) {
                options.aovs.aovs.push(aov);
            }
        }
        let up = match args.turn.nerf_up {
            Some(UpArg::Y) => WorldUp::Y,
            Some(UpArg::Z) | None => WorldUp::Z,
        };
        Ok(DatasetPlan { count, time: args.time.time.unwrap_or(0.0), up })
    }

    /// All views, also those that --only or --chunk leave out.
    pub fn frames(&self) -> impl Iterator<Item = PlannedFrame> {
        let DatasetPlan { count, time, .. } = *self;
        (1..=i64::from(count)).map(move |frame| view_frame(frame, count, time))
    }

    /// The `transforms.json` beside the images of a scene.
    pub fn transforms_file(&self, outputs: &Outputs, scene: &Path, index: usize) -> PathBuf {
        match outputs.target(scene, index, &view_frame(1, self.count, self.time)) {
            Target::File(image) => image.with_file_name(TRANSFORMS),
            Target::Stdout => TRANSFORMS.into(),
        }
    }

    /// Checks that the images of each dataset are in one folder, that no two datasets share a folder, and that names
    /// are UTF-8.
    pub fn check_names(&self, scenes: &[PathBuf], outputs: &Outputs) -> Result<(), UsageError> {
        let mut transforms_files: HashMap<PathBuf, &PathBuf> = HashMap::new();
        for (i, scene) in scenes.iter().enumerate() {
            let transforms = self.transforms_file(outputs, scene, i + 1);
            let last = view_frame(i64::from(self.count), self.count, self.time);
            let last = outputs.target(scene, i + 1, &last);
            if !matches!(&last, Target::File(last) if last.parent() == transforms.parent()) {
                return Err(UsageError(
                    "--views: the images of a dataset must be in one folder; use the frame number only in file names"
                        .into(),
                ));
            }
            if let Target::File(image) = &last
                && image.file_name().is_some_and(|name| name.to_str().is_none())
            {
                return Err(UsageError(format!(
                    "--views: the name {} is not UTF-8, as {TRANSFORMS} requires; set another name with -o",
                    image.display()
                )));
            }
            if let Some(other) = transforms_files.insert(transforms.clone(), scene) {
                return Err(UsageError(format!(
                    "{} and {} would both write {}; use {{stem}}/ in -o",
                    other.display(),
                    scene.display(),
                    transforms.display()
                )));
            }
        }
        Ok(())
    }
}
