//! Pinhole cameras in pixels, as dataset formats describe them.

use glam::{DMat3, DQuat, DVec3};

use super::world_up::WorldUp;
use blinn_render::PixelRect;
use blinn_scene::{Camera, Intrinsics};

/// Focal lengths and principal point in pixels of an image. Rows run downward; the centre of pixel (i, j) is at
/// (i + ½, j + ½).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Focal length along rows.
    pub fx: f64,
    /// Focal length along columns.
    pub fy: f64,
    /// Column of the principal point.
    pub cx: f64,
    /// Row of the principal point.
    pub cy: f64,
    /// Width of the image in pixels.
    pub width: u32,
    /// Height of the image in pixels.
    pub height: u32,
}

impl Pinhole {
    /// The intrinsics of the part `window` of an image of `size` pixels. The camera is perspective.
    pub fn new(camera: &Camera, size: (u32, u32), window: PixelRect) -> Pinhole {
        let Intrinsics { fx, fy, cx, cy } = Intrinsics::of(camera, size);
        let PixelRect { x, y, width, height } = window;
        Pinhole { fx, fy, cx: cx - f64::from(x), cy: cy - f64::from(y), width, height }
    }
}

/// A rigid transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidPose {
    /// Rotation.
    pub rotation: DMat3,
    /// Translation in metres.
    pub translation: DVec3,
}

impl RigidPose {
    /// From the dataset's world to the space of a camera after OpenCV: x to the right, y downward, z forward.
    pub fn world_to_camera(camera: &Camera, up: WorldUp) -> RigidPose {
        let [u, v, w] = [camera.basis.u, camera.basis.v, camera.basis.w].map(|axis| up.rotation() * axis);
        let rotation = DMat3::from_cols(u, -v, -w).transpose();
        RigidPose { rotation, translation: -(rotation * (up.rotation() * camera.view_point)) }
    }

    /// `first`, then this transform.
    pub fn after(&self, first: &RigidPose) -> RigidPose {
        RigidPose {
            rotation: self.rotation * first.rotation,
            translation: self.rotation * first.translation + self.translation,
        }
    }

    /// Transforms a point.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.rotation * p + self.translation
    }

    /// The inverse.
    pub fn inverse(&self) -> RigidPose {
        let rotation = self.rotation.transpose();
        RigidPose { rotation, translation: -(rotation * self.translation) }
    }

    /// The rotation as a unit quaternion with w ≥ 0.
    pub fn quaternion(&self) -> DQuat {
        let q = DQuat::from_mat3(&self.rotation).normalize();
        if q.w < 0.0 { -q } else { q }
    }

    /// The rotation row by row.
    pub fn rows(&self) -> [f64; 9] {
        // Adding 0 replaces −0.
        self.rotation.transpose().to_cols_array().map(|x| x + 0.0)
    }
}
