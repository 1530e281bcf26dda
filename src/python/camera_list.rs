//! Lists of cameras in files.

use std::path::PathBuf;

use pyo3::prelude::*;

use super::camera::PyCamera;
use super::errors::{CallDepth, camera_list_error, value_error, warn};
use super::size::optional_size;
use blinn_import::{CameraFile, Limits};
use blinn_scene::UpAxis;
use blinn_session::pictures_without_pose;

/// Load the cameras of a list: transforms.json of NeRF tools, a COLMAP model, BOP's scene_camera.json, or JSON lines.
///
/// `size` = (width, height) is needed where the list has no sizes. `up` is the up axis of the list's world, "y" or "z";
/// "z" turns (x, y, z) into (x, z, −y), as Blender's exporter does. By default it is "y", or what the list names.
#[pyfunction]
#[pyo3(signature = (path, *, size = None, up = None))]
pub fn load_cameras(
    py: Python<'_>,
    path: PathBuf,
    size: Option<&Bound<'_, PyAny>>,
    up: Option<&str>,
) -> PyResult<Vec<PyCamera>> {
    let size = optional_size(size)?;
    if size.is_some_and(|(width, height)| width == 0 || height == 0) {
        return Err(value_error("the size must be positive"));
    }
    let name = path.display().to_string();
    let file = CameraFile::open(&path, &Limits::default()).map_err(camera_list_error)?;
    let without_pose = file.without_pose();
    if without_pose > 0 {
        warn(py, &name, &[pictures_without_pose(without_pose)], CallDepth::Direct)?;
    }
    let up = match up {
        None => file.up(),
        Some("y") => UpAxis::Y,
        Some("z") => UpAxis::Z,
        Some(other) => return Err(value_error(format!("up must be \"y\" or \"z\", not {other:?}"))),
    };
    let file = file.with_up(up);
    let camera = |index: usize| {
        let listed = file.camera(index).map_err(camera_list_error)?;
        let size = listed.size.or(size).ok_or_else(|| {
            value_error(format!("camera {} of {name} has no size; pass size=(width, height)", index + 1))
        })?;
        Ok(PyCamera::from_camera(&listed.camera(size), size))
    };
    (0..file.len()).map(camera).collect()
}
