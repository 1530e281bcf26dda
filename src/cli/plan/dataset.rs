//! `turntable --views`: views from all around a scene, as a training set for NeRF and Gaussian splatting.

use std::path::{Path, PathBuf};

use super::animation_output::animation_format;
use super::outputs::{Outputs, Target};
use crate::args::{TurntableArgs, UnitShapeArg, UpArg, ViewSamplingArgs};
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_output::datasets::WorldUp;
use blinn_render::integrator::Aov;
use blinn_scene::{Orbit, Projection, UnitShape, ViewSampling};
use blinn_session::{DatasetPlan, Options, PlannedFrame};

/// AOVs that every dataset has.
const AOVS: [Aov; 3] = [Aov::Depth, Aov::Normal, Aov::Mask];
/// The file with the cameras of all views.
const TRANSFORMS: &str = "transforms.json";

/// Resolves a dataset. Sets projection, orbit and AOVs in `options`.
pub fn dataset_plan(
    count: u32,
    args: &TurntableArgs,
    options: &mut Options,
) -> Result<DatasetPlan, UsageError> {
    if options.view.projection == Some(Projection::Orthographic) {
        return Err(UsageError(worded!(
            "`views`: {} supports only perspective cameras; remove the orthographic projection",
            TRANSFORMS
        )));
    }
    if args.output.output.as_deref().and_then(animation_format).is_some() {
        let text =
            worded!("`views`: a dataset consists of images; set `output` to .png, .jpg, .webp or .exr");
        return Err(UsageError(text));
    }
    options.view.projection = Some(Projection::Perspective);
    let sampling = sampling(&args.turn.sampling, options.seed);
    if args.turn.sampling.random_per_scene && !sampling.is_random() {
        return Err(UsageError(worded!(
            "`random-per-scene`: nothing is random; add `on` random, `distance-range`, `roll`, `look-at-jitter`, \
             `random-lights`, or `random-hdri`"
        )));
    }
    let has_elevation = sampling.elevation.is_some();
    sampling.layout.check(count, has_elevation).map_err(|text| UsageError(worded!("`on`: {}", text)))?;
    options.normalize = args.turn.sampling.normalize.map(|shape| match shape {
        UnitShapeArg::UnitCube => UnitShape::Cube,
        UnitShapeArg::UnitSphere => UnitShape::Sphere,
    });
    for aov in AOVS {
        if !options.aovs.aovs.contains(&aov) {
            options.aovs.aovs.push(aov);
        }
    }
    let up = match args.turn.world_up {
        Some(UpArg::Y) => WorldUp::Y,
        Some(UpArg::Z) | None => WorldUp::Z,
    };
    let dataset = DatasetPlan { count, time: args.time.time.unwrap_or(0.0), up, sampling };
    options.view.orbit = first_orbit(&dataset);
    Ok(dataset)
}

/// The position of the first view, in which the scene is framed and metered.
pub fn first_orbit(dataset: &DatasetPlan) -> Option<Orbit> {
    dataset.views(1..=1).next().and_then(|frame| frame.view).map(|view| view.orbit)
}

impl Outputs {
    /// The `transforms.json` beside the images of a scene.
    pub fn transforms_file(&self, scene: &Path, index: usize) -> PathBuf {
        match self.target(scene, index, &PlannedFrame::at(1, 0.0)) {
            Target::File(image) => image.with_file_name(TRANSFORMS),
            Target::Stdout => TRANSFORMS.into(),
        }
    }
}

/// Checks that the images of a scene are in one folder, and that their names are UTF-8.
pub fn check_folder(
    dataset: &DatasetPlan,
    scene: &Path,
    index: usize,
    outputs: &Outputs,
) -> Result<(), UsageError> {
    let transforms = outputs.transforms_file(scene, index);
    let last = PlannedFrame::at(i64::from(dataset.count), dataset.time);
    let last = outputs.target(scene, index, &last);
    if !matches!(&last, Target::File(last) if last.parent() == transforms.parent()) {
        return Err(UsageError(worded!(
            "`views`: the images of a dataset must be in one folder; use the frame number only in file names"
        )));
    }
    match &last {
        Target::File(image) if image.file_name().is_some_and(|name| name.to_str().is_none()) => {
            Err(UsageError(worded!(
                "`views`: the name {} is not UTF-8, as {} requires; set another name with `output`",
                image.display(),
                TRANSFORMS
            )))
        }
        _ => Ok(()),
    }
}

fn sampling(args: &ViewSamplingArgs, seed: u32) -> ViewSampling {
    ViewSampling {
        layout: args.on.unwrap_or_default(),
        elevation: args.elevation_range,
        distance: args.distance_range,
        roll: args.roll.unwrap_or(0.0),
        look_at_jitter: args.look_at_jitter.unwrap_or(0.0),
        random_lights: args.random_lights,
        random_environment: args.random_hdri,
        seed,
    }
}
