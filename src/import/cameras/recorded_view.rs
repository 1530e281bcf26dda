//! The exact view that blinn records in its own `transforms.json`, so that the same images can be rendered again to the byte.

use glam::{DVec2, DVec3};
use serde::Deserialize;

use super::picture_size::picture_size;
use blinn_scene::UpAxis;
use blinn_scene::{Camera, ClipPlanes, Intrinsics, Normalization};

/// The lens of all cameras as it was rendered, and the world of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedView {
    /// False if a lens in pixels differs: somebody changed the file.
    pub is_exact: bool,
    /// Up axis of the world of the file.
    pub up: UpAxis,
    /// Width and height of the image without crop.
    pub size: (u32, u32),
    /// Left, top, width and height of the rendered region in pixels.
    pub crop: Option<[u32; 4]>,
    /// Time of the scene in seconds.
    pub time: f64,
    /// Width of the view rectangle.
    pub view_width: f64,
    /// Height of the view rectangle.
    pub view_height: f64,
    /// Centre of the view rectangle along u and v.
    pub view_centre: DVec2,
    /// Projection distance d.
    pub proj_distance: f64,
    /// Clipping planes.
    pub clip: ClipPlanes,
    /// From the scene's world to the units of the file. `None` for metres.
    pub normalization: Option<Normalization>,
}

/// The object in the file.
#[derive(Deserialize)]
pub(super) struct RecordedKeys {
    up: String,
    size: [f64; 2],
    crop: Option<[f64; 4]>,
    time: f64,
    view_width: f64,
    view_height: f64,
    view_centre: [f64; 2],
    proj_distance: f64,
    /// Near and far; without a far plane null.
    clip: Option<(f64, Option<f64>)>,
    normalization: Option<NormalizationKeys>,
}

#[derive(Clone, Copy, Deserialize)]
struct NormalizationKeys {
    centre: [f64; 3],
    scale: f64,
}

impl RecordedKeys {
    /// The view, or the defect.
    pub fn to_view(&self) -> Result<RecordedView, String> {
        let up = match self.up.as_str() {
            "y" => UpAxis::Y,
            "z" => UpAxis::Z,
            other => return Err(format!("up '{other}' must be \"y\" or \"z\"")),
        };
        let size = picture_size(Some(self.size[0]), Some(self.size[1]))?.ok_or("has no size")?;
        let lengths = [self.view_width, self.view_height, self.proj_distance];
        if lengths.iter().any(|length| !(*length > 0.0 && length.is_finite())) {
            return Err("view_width, view_height and proj_distance must be greater than zero".into());
        }
        let clip = match self.clip {
            None => ClipPlanes::OFF,
            Some((near, far)) => ClipPlanes { near, far: far.unwrap_or(f64::INFINITY) },
        };
        if !(clip.near >= 0.0 && clip.far > clip.near) {
            return Err("clip must be [near, far] with 0 ≤ near < far".into());
        }
        Ok(RecordedView {
            is_exact: true,
            up,
            size,
            crop: self.crop.map(|crop| crop_in(crop, size)).transpose()?,
            time: self.time,
            view_width: self.view_width,
            view_height: self.view_height,
            view_centre: DVec2::from_array(self.view_centre),
            proj_distance: self.proj_distance,
            clip,
            normalization: self.normalization.map(NormalizationKeys::to_normalization).transpose()?,
        })
    }
}

impl NormalizationKeys {
    fn to_normalization(self) -> Result<Normalization, String> {
        let NormalizationKeys { centre, scale } = self;
        // Numbers of JSON are finite.
        let is_valid = scale.is_normal() && scale > 0.0 && (1.0 / scale).is_normal();
        match is_valid {
            true => Ok(Normalization { centre: DVec3::from_array(centre), scale }),
            false => Err(format!("normalization.scale must be greater than zero, not {scale}")),
        }
    }
}

/// A region inside an image.
fn crop_in(crop: [f64; 4], size: (u32, u32)) -> Result<[u32; 4], String> {
    let [x, y, width, height] = crop;
    let is_whole = crop.iter().all(|v| *v >= 0.0 && v.fract() == 0.0) && width >= 1.0 && height >= 1.0;
    if !is_whole || x + width > f64::from(size.0) || y + height > f64::from(size.1) {
        return Err("crop must be [x, y, width, height] inside the image".into());
    }
    Ok(crop.map(|v| v as u32))
}

/// Largest relative difference of the lens in pixels from the recorded one: both were rounded.
const LENS_TOLERANCE: f64 = 1e-9;
/// Largest difference of a position from the recorded one, relative to its distance from the origin of the file: both
/// were rounded.
const POSITION_TOLERANCE: f64 = 1e-9;

impl RecordedView {
    /// `camera` with the recorded lens.
    pub fn lens_of(&self, camera: &Camera) -> Camera {
        Camera {
            view_width: self.view_width,
            view_height: self.view_height,
            view_centre: self.view_centre,
            proj_distance: self.proj_distance,
            clip: self.clip,
            ..*camera
        }
    }

    /// The position of a camera in metres along the axes of the file, which has it as `point`. `recorded` is the exact one
    /// in the scene's world; it counts unless somebody changed the file.
    pub(super) fn position_in_metres(&self, point: DVec3, recorded: Option<DVec3>) -> DVec3 {
        let Some(normalization) = self.normalization else { return point };
        let Normalization { centre, scale } = normalization;
        let in_file = |p: DVec3| match self.up {
            UpAxis::Y => p,
            UpAxis::Z => DVec3::new(p.x, 0.0 - p.z, p.y),
        };
        let is_same = |exact: &DVec3| {
            let size = point.length().max(scale * centre.length());
            (in_file(normalization.point(*exact)) - point).length() <= POSITION_TOLERANCE * size
        };
        let exact = recorded.filter(is_same).map(in_file);
        exact.unwrap_or_else(|| point / scale + in_file(centre))
    }

    /// Returns true if the lens of `camera`, for images of the cropped size, is the recorded one. Otherwise somebody
    /// changed the file.
    pub(super) fn matches(&self, camera: &Camera, size: Option<(u32, u32)>) -> bool {
        let [x, y, width, height] = self.crop.unwrap_or([0, 0, self.size.0, self.size.1]);
        let own = Intrinsics::of(&self.lens_of(camera), self.size);
        let other = Intrinsics::of(camera, (width, height));
        let scale = own.fx.max(own.fy).max(f64::from(self.size.0)).max(f64::from(self.size.1));
        let is_near = |a: f64, b: f64| (a - b).abs() <= LENS_TOLERANCE * scale;
        size == Some((width, height))
            && is_near(own.fx, other.fx)
            && is_near(own.fy, other.fy)
            && is_near(own.cx - f64::from(x), other.cx)
            && is_near(own.cy - f64::from(y), other.cy)
    }
}
