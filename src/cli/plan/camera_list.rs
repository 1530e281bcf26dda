//! Opens the list of `--cameras`.

use crate::args::{CameraListArgs, UpArg};
use crate::usage::UsageError;
use blinn_import::Limits;
use blinn_scene::UpAxis;
use blinn_session::{CameraList, Options, ReplacedCameraFields};

/// Opens the list of --cameras, if there is one.
pub fn open(
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
