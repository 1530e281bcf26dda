//! Inputs of a plan besides arguments: options, and the lists of scenes and cameras, which are read before.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::scene_list::{SceneList, scene_list};
use crate::args::{
    CameraListArgs, CommonArgs, OptionArgs, PictureGroup, RenderArgs, SceneArgs, TimeArgs, TurntableArgs,
    UpArg, named_options,
};
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_import::Limits;
use blinn_scene::UpAxis;
use blinn_session::{CameraList, FrameList, Options, ReplacedCameraFields, load_limits};

/// The options of pictures and the lists of a command line.
#[derive(Debug)]
pub struct PlanInputs {
    pub options: Options,
    pub scenes: Arc<SceneList>,
    /// The list of --cameras.
    pub cameras: Option<Arc<CameraList>>,
}

impl PlanInputs {
    /// Reads the lists of `blinn render`.
    ///
    /// # Errors
    /// The options suit no picture, or a list cannot be read.
    pub fn of_render(args: &RenderArgs) -> Result<PlanInputs, UsageError> {
        let options = picture_options(&args.scene, &args.options, &args.time, &args.common)?;
        let replaced =
            ReplacedCameraFields { size: options.size, crop: options.crop, clip: options.view.clip };
        let CameraListArgs { cameras, world_up, .. } = &args.cameras;
        let limits = load_limits(args.process.max_memory);
        let open = |path: &PathBuf| open_cameras(path, *world_up, replaced, &limits);
        let cameras = cameras.as_ref().map(open).transpose()?;
        let scenes = Arc::new(scene_list(&args.scene.scenes)?);
        Ok(PlanInputs { options, scenes, cameras: cameras.map(Arc::new) })
    }

    /// Reads the list of `blinn turntable`.
    ///
    /// # Errors
    /// As [`PlanInputs::of_render`].
    pub fn of_turntable(args: &TurntableArgs) -> Result<PlanInputs, UsageError> {
        let options = picture_options(&args.scene, &args.options, &args.time, &args.common)?;
        Ok(PlanInputs { options, scenes: Arc::new(scene_list(&args.scene.scenes)?), cameras: None })
    }
}

/// The options of pictures that a command line sets.
fn picture_options(
    scene: &SceneArgs,
    picture: &OptionArgs<PictureGroup>,
    time: &TimeArgs,
    common: &CommonArgs,
) -> Result<Options, UsageError> {
    let groups = [&scene.options.given, &picture.given, &time.animation.given, &common.files.given];
    Ok(named_options(groups)?.finish()?)
}

/// Opens the list of --cameras.
///
/// # Errors
/// It cannot be read.
pub fn open_cameras(
    path: &Path,
    world_up: Option<UpArg>,
    replaced: ReplacedCameraFields,
    limits: &Limits,
) -> Result<CameraList, UsageError> {
    let up = world_up.map(|up| match up {
        UpArg::Z => UpAxis::Z,
        UpArg::Y => UpAxis::Y,
    });
    CameraList::open(path, up, replaced, limits).map_err(|e| UsageError(worded!("`cameras`: {}", e)))
}

/// Checks that the numbers of --only are those of cameras in a list of `count`.
///
/// # Errors
/// There is no camera of a number.
pub fn check_only(only: Option<&FrameList>, count: usize) -> Result<(), UsageError> {
    let count = count as i64;
    let mut numbers = only.into_iter().flat_map(|list| list.frames());
    match numbers.find(|number| !(1..=count).contains(*number)) {
        Some(outside) => Err(UsageError(worded!("`only` {}: the cameras are 1 to {}", outside, count))),
        None => Ok(()),
    }
}
