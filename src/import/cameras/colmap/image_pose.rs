//! The pose of an image, and the lens of its camera.

use std::collections::HashMap;

use glam::DVec3;

use super::camera_models::CameraLens;
use crate::cameras::listed_camera::ListedCamera;
use crate::cameras::names::picture_name;
use blinn_scene::{CameraAxes, LightRotation, SimilarityTransform};

/// Lenses by the ids of cameras.
pub(super) type LensesById = HashMap<u32, CameraLens>;

/// An image: its pose from the world to the camera, in OpenCV's axes.
pub(super) struct ImagePose<'a> {
    /// w, x, y, z.
    pub quaternion: [f64; 4],
    pub translation: DVec3,
    pub camera_id: u32,
    pub name: &'a str,
}

impl ImagePose<'_> {
    pub fn to_camera(&self, lenses: &LensesById) -> Result<ListedCamera, String> {
        let id = self.camera_id;
        let lens = lenses.get(&id).ok_or_else(|| format!("camera {id} is not in the list of cameras"))?;
        let (lens, size) = lens.clone()?;
        let to_camera = SimilarityTransform::from_quaternion(self.quaternion, self.translation)?;
        let (view_point, basis) = to_camera.inverse().camera_pose(CameraAxes::OpenCv);
        Ok(ListedCamera {
            name: picture_name(self.name),
            view_point,
            basis,
            lens,
            size: Some(size),
            time: None,
            depth_step: None,
            light: LightRotation::default(),
        })
    }
}
