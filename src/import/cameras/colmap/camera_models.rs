//! COLMAP's camera models.

use crate::cameras::lens::Lens;
use crate::cameras::picture_size::picture_size;
use blinn_scene::NEGLIGIBLE;

/// A lens with the size of its pictures, or the reason why it is not supported.
pub(super) type CameraLens = Result<(Lens, (u32, u32)), String>;

/// A camera model: its parameters are one or two focal lengths, the principal point, and the distortion.
struct CameraModel {
    id: i32,
    name: &'static str,
    /// 1 or 2 for pinholes.
    focal_lengths: usize,
    /// Number of coefficients of distortion.
    distortion: usize,
    /// False if the projection is not that of a pinhole even without distortion.
    is_pinhole: bool,
}

const fn model(
    id: i32,
    name: &'static str,
    focal_lengths: usize,
    distortion: usize,
    is_pinhole: bool,
) -> CameraModel {
    CameraModel { id, name, focal_lengths, distortion, is_pinhole }
}

/// The models of COLMAP 4.2.
const MODELS: [CameraModel; 18] = [
    model(0, "SIMPLE_PINHOLE", 1, 0, true),
    model(1, "PINHOLE", 2, 0, true),
    model(2, "SIMPLE_RADIAL", 1, 1, true),
    model(3, "RADIAL", 1, 2, true),
    model(4, "OPENCV", 2, 4, true),
    model(5, "OPENCV_FISHEYE", 2, 4, false),
    model(6, "FULL_OPENCV", 2, 8, true),
    model(7, "FOV", 2, 1, true),
    model(8, "SIMPLE_RADIAL_FISHEYE", 1, 1, false),
    model(9, "RADIAL_FISHEYE", 1, 2, false),
    model(10, "THIN_PRISM_FISHEYE", 2, 8, false),
    model(11, "RAD_TAN_THIN_PRISM_FISHEYE", 2, 12, false),
    model(12, "SIMPLE_DIVISION", 1, 1, true),
    model(13, "DIVISION", 2, 1, true),
    model(14, "SIMPLE_FISHEYE", 1, 0, false),
    model(15, "FISHEYE", 2, 0, false),
    model(16, "EUCM", 2, 2, false),
    // Its parameters are the size.
    model(17, "EQUIRECTANGULAR", 0, 0, false),
];

const UNDISTORT: &str = "undistort the images with colmap image_undistorter, which writes PINHOLE cameras";

/// Most parameters of a model.
pub(super) const MAX_PARAMETERS: usize = 16;

/// The number of parameters of the model with this id; `None` if the id is not known.
pub(super) fn parameter_count(id: i32) -> Option<usize> {
    MODELS.iter().find(|model| model.id == id).map(CameraModel::parameter_count)
}

/// The name of the model with this id.
pub(super) fn model_name(id: i32) -> Option<&'static str> {
    MODELS.iter().find(|model| model.id == id).map(|model| model.name)
}

/// The lens of a camera, or why it is not supported.
pub(super) fn camera_lens(id: u32, name: &str, width: f64, height: f64, parameters: &[f64]) -> CameraLens {
    let located = |message: String| format!("camera {id}: {message}");
    let Some(model) = MODELS.iter().find(|model| model.name == name) else {
        return Err(located(format!("the model {name} is not supported; {UNDISTORT}")));
    };
    if !model.is_pinhole {
        return Err(located(format!("the model {name} is not a pinhole; {UNDISTORT}")));
    }
    if parameters.len() != model.parameter_count() {
        let (count, expected) = (parameters.len(), model.parameter_count());
        return Err(located(format!("the model {name} has {expected} parameters, not {count}")));
    }
    let (fx, rest) = (parameters[0], &parameters[model.focal_lengths..]);
    if rest[2..].iter().any(|coefficient| !(coefficient.abs() <= NEGLIGIBLE)) {
        return Err(located(format!("the model {name} has distortion, which is not supported; {UNDISTORT}")));
    }
    let fy = if model.focal_lengths == 2 { parameters[1] } else { fx };
    let lens = Lens::Pixels { fx, fy, cx: Some(rest[0]), cy: Some(rest[1]) };
    lens.check().map_err(located)?;
    let size = picture_size(Some(width), Some(height)).map_err(located)?;
    Ok((lens, size.ok_or_else(|| located("the picture has no size".into()))?))
}

impl CameraModel {
    fn parameter_count(&self) -> usize {
        self.focal_lengths + 2 + self.distortion
    }
}
