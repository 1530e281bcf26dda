//! Opens the list of `--cameras`.

use crate::args::{CameraListArgs, ImageArgs, UpArg};
use crate::usage::UsageError;
use blinn_import::{Limits, UpAxis};
use blinn_scene::ClipPlanes;
use blinn_session::{CameraList, ReplacedCameraFields};

/// Opens the list of --cameras, if there is one.
pub fn open(
    args: &CameraListArgs,
    image: &ImageArgs,
    clip: Option<ClipPlanes>,
    limits: &Limits,
) -> Result<Option<CameraList>, UsageError> {
    let Some(path) = &args.cameras else { return Ok(None) };
    let up = args.world_up.map(|up| match up {
        UpArg::Z => UpAxis::Z,
        UpArg::Y => UpAxis::Y,
    });
    let replaced = ReplacedCameraFields { size: image.size, crop: image.crop, clip };
    let list = CameraList::open(path, up, replaced, limits);
    list.map(Some).map_err(|e| UsageError(format!("--cameras: {e}")))
}
