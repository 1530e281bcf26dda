//! `scene_camera.json` of BOP: for each image id, K and the pose in millimetres.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;

use glam::DVec3;
use serde::Deserialize;
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use super::json;
use super::lens::Lens;
use super::listed_camera::{ListedCamera, MAX_CAMERAS};
use super::matrix::Matrix;
use crate::error::LoadError;
use blinn_scene::{CameraAxes, LightRotation, SimilarityTransform};

/// Metres per millimetre.
const MILLIMETRE: f64 = 1e-3;

/// The camera of an image. Other keys are ignored.
#[derive(Deserialize)]
struct BopCamera {
    #[serde(rename = "cam_K")]
    k: Option<Matrix>,
    #[serde(rename = "cam_R_w2c")]
    rotation: Option<Matrix>,
    #[serde(rename = "cam_t_w2c")]
    translation: Option<Matrix>,
    /// Millimetres per step of depth images.
    depth_scale: Option<f64>,
}

/// Cameras by image id.
#[derive(Default)]
struct BopCameras {
    by_id: BTreeMap<u32, ListedCamera>,
    /// The images without a pose.
    without_pose: BTreeSet<u32>,
}

/// Loads the cameras in the order of their ids, and the number of images without a pose, unless none has one.
pub(super) fn load(path: &Path, limit: u64) -> Result<(Vec<ListedCamera>, usize), LoadError> {
    let BopCameras { by_id, without_pose } = json::read_document(path, limit)?;
    if let (true, Some(id)) = (by_id.is_empty(), without_pose.first()) {
        let text = format!("image {id} has no cam_R_w2c and cam_t_w2c, the pose of the camera");
        return Err(LoadError::parse(path.display(), text));
    }
    Ok((by_id.into_values().collect(), without_pose.len()))
}

impl BopCamera {
    /// The camera; `None` if its pose is not known. `id` numbers the image, and names it as BOP does.
    fn to_camera(&self, id: u32) -> Result<Option<ListedCamera>, String> {
        let named = |key: &'static str| move |defect: String| format!("{key} {defect}");
        let k = self.k.as_ref().ok_or("has no cam_K")?;
        let lens = Lens::from(k.to_intrinsics().map_err(named("cam_K"))?);
        lens.check().map_err(|defect| format!("cam_K: {defect}"))?;
        let (rotation, translation) = match (&self.rotation, &self.translation) {
            (Some(rotation), Some(translation)) => (rotation, translation),
            (None, None) => return Ok(None),
            (None, _) => return Err("has no cam_R_w2c, the rotation of the camera".into()),
            (_, None) => return Err("has no cam_t_w2c, the translation of the camera".into()),
        };
        let rotation = rotation.to_rotation().map_err(named("cam_R_w2c"))?;
        let translation: DVec3 = translation.to_vector().map_err(named("cam_t_w2c"))?;
        let to_camera =
            SimilarityTransform::new(rotation, translation * MILLIMETRE).map_err(named("cam_R_w2c"))?;
        if let Some(scale) = self.depth_scale.filter(|scale| !(*scale > 0.0 && scale.is_finite())) {
            return Err(format!("depth_scale must be greater than zero, not {scale}"));
        }
        let (view_point, basis) = to_camera.inverse().camera_pose(CameraAxes::OpenCv);
        Ok(Some(ListedCamera {
            name: Some(format!("{id:06}")),
            view_point,
            basis,
            lens,
            size: None,
            time: None,
            depth_step: self.depth_scale.map(|scale| scale * MILLIMETRE),
            light: LightRotation::default(),
        }))
    }
}

impl<'de> Deserialize<'de> for BopCameras {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<BopCameras, D::Error> {
        struct CamerasVisitor;
        impl<'de> Visitor<'de> for CamerasVisitor {
            type Value = BopCameras;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an object with a camera for each image id")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<BopCameras, A::Error> {
                let mut cameras = BopCameras::default();
                while let Some(key) = map.next_key::<String>()? {
                    let id =
                        key.parse().map_err(|_| A::Error::custom(format!("'{key}' is not an image id")))?;
                    let camera = map.next_value::<BopCamera>()?.to_camera(id);
                    let camera = camera.map_err(|text| A::Error::custom(format!("image {id} {text}")))?;
                    if cameras.by_id.len() + cameras.without_pose.len() == MAX_CAMERAS {
                        return Err(A::Error::custom(format!("more than {MAX_CAMERAS} cameras")));
                    }
                    match camera {
                        Some(camera) => drop(cameras.by_id.insert(id, camera)),
                        None => drop(cameras.without_pose.insert(id)),
                    }
                }
                Ok(cameras)
            }
        }
        deserializer.deserialize_map(CamerasVisitor)
    }
}
