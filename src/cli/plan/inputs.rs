//! Inputs of a plan besides arguments: options, and the lists of scenes and cameras, which are read before.

use std::sync::Arc;

use super::scene_list::{SceneList, scene_list};
use crate::args::{
    CameraListArgs, CommonArgs, OptionArgs, PictureGroup, RenderArgs, SceneArgs, TimeArgs, TurntableArgs,
    UpArg, named_options,
};
use crate::usage::UsageError;
use blinn_import::Limits;
use blinn_scene::UpAxis;
use blinn_session::{CameraList, Options, ReplacedCameraFields, load_limits};

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
        let cameras = open_cameras(&args.cameras, &options, &load_limits(args.process.max_memory))?;
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

/// Opens the list of --cameras, if there is one.
fn open_cameras(
    args: &CameraListArgs,
    options: &Options,
    limits: &Limits,
) -> Result<Option<CameraList>, UsageError> {
    let Some(path) = &args.cameras else { return Ok(None) };
    let up = args.world_up.map(|up| match up {
        UpArg::Z => UpAxis::Z,
        UpArg::Y => UpAxis::Y,
    });
    let replaced = ReplacedCameraFields { size: options.size, crop: options.crop, clip: options.view.clip };
    let list = CameraList::open(path, up, replaced, limits);
    list.map(Some).map_err(|e| UsageError(format!("--cameras: {e}")))
}
