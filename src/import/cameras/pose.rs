//! Poses: positions and axes from rigid transforms.

use glam::{DMat3, DVec3};

use blinn_core::geometry::Basis;

/// The axes of camera space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CameraAxes {
    /// x right, y up, z backward: glTF, Blender, NeRF.
    OpenGl,
    /// x right, y down, z forward: COLMAP, BOP, OpenCV.
    OpenCv,
}

/// A rotation and a translation, x ↦ R x + t. R may deviate from a rotation by the rounding of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RigidTransform {
    pub rotation: DMat3,
    pub translation: DVec3,
}

/// Largest deviation of the columns' lengths from 1 and of their scalar products from 0.
const TOLERANCE: f64 = 1e-2;
/// Farthest position from the origin in metres: coordinates are single precision.
pub(super) const FARTHEST: f64 = f32::MAX as f64;

impl RigidTransform {
    /// Builds the transform, or returns the defect.
    pub fn new(rotation: DMat3, translation: DVec3) -> Result<RigidTransform, String> {
        if !rotation.is_finite() || !translation.is_finite() {
            return Err("has a number that is not finite".into());
        }
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = rotation;
        let lengths = [x, y, z].map(DVec3::length);
        if lengths.iter().any(|length| (length - 1.0).abs() > TOLERANCE) {
            let [a, b, c] = lengths;
            return Err(format!(
                "is not a rotation: its columns have lengths {a:.4}, {b:.4} and {c:.4} instead of 1; remove the scale"
            ));
        }
        if [x.dot(y), y.dot(z), z.dot(x)].iter().any(|dot| dot.abs() > TOLERANCE) {
            return Err("is not a rotation: its columns are not perpendicular to each other".into());
        }
        if x.cross(y).dot(z) < 0.0 {
            return Err("mirrors: its determinant is −1; swap or negate an axis".into());
        }
        if translation.abs().max_element() > FARTHEST {
            return Err("is too far from the origin for single precision".into());
        }
        Ok(RigidTransform { rotation, translation })
    }

    /// Builds the transform of a unit quaternion and a translation.
    pub fn from_quaternion([w, x, y, z]: [f64; 4], translation: DVec3) -> Result<RigidTransform, String> {
        let length = (w * w + x * x + y * y + z * z).sqrt();
        if !(length > 1e-9 && length.is_finite()) {
            return Err(format!("the quaternion has length {length} instead of 1"));
        }
        let [w, x, y, z] = [w, x, y, z].map(|q| q / length);
        let rotation = DMat3::from_cols(
            DVec3::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)),
            DVec3::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)),
            DVec3::new(2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)),
        );
        RigidTransform::new(rotation, translation).map_err(|defect| format!("the pose {defect}"))
    }

    /// The inverse of the matrix, exact also where R is rounded.
    pub fn inverse(&self) -> RigidTransform {
        let rotation = self.rotation.inverse();
        RigidTransform { rotation, translation: -(rotation * self.translation) }
    }

    /// Position and axes of a camera with this camera-to-world transform.
    pub fn camera_pose(&self, axes: CameraAxes) -> (DVec3, Basis) {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = self.rotation;
        let basis = match axes {
            CameraAxes::OpenGl => Basis { u: x, v: y, w: z },
            CameraAxes::OpenCv => Basis { u: x, v: -y, w: -z },
        };
        (self.translation, basis)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_rotate_about_their_axes() {
        let half = 0.5f64.sqrt();
        let pose = RigidTransform::from_quaternion([half, 0.0, half, 0.0], DVec3::ONE).unwrap();
        assert!((pose.rotation * DVec3::Z).abs_diff_eq(DVec3::X, 1e-15));
        let back = pose.inverse();
        let p = DVec3::new(3.0, -2.0, 0.5);
        let there = pose.rotation * p + pose.translation;
        assert!((back.rotation * there + back.translation).abs_diff_eq(p, 1e-14));
        assert!(RigidTransform::from_quaternion([0.0; 4], DVec3::ZERO).is_err());
        assert!(RigidTransform::from_quaternion([f64::NAN, 0.0, 0.0, 1.0], DVec3::ZERO).is_err());
    }

    #[test]
    fn cameras_look_along_their_conventions() {
        let pose = RigidTransform { rotation: DMat3::IDENTITY, translation: DVec3::X };
        assert_eq!(pose.camera_pose(CameraAxes::OpenGl).1.w, DVec3::Z);
        let (e, basis) = pose.camera_pose(CameraAxes::OpenCv);
        assert_eq!((e, basis.u, basis.v, basis.w), (DVec3::X, DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z));
    }

    #[test]
    fn scaled_sheared_mirrored_and_infinite_matrices_are_refused() {
        let columns = DMat3::from_cols;
        for (matrix, defect) in [
            (DMat3::from_diagonal(DVec3::splat(2.0)), "lengths 2.0000"),
            (DMat3::ZERO, "lengths 0.0000"),
            (columns(DVec3::X, DVec3::new(0.6, 0.8, 0.0), DVec3::Z), "not perpendicular"),
            (columns(DVec3::X, DVec3::X, DVec3::Z), "not perpendicular"),
            (DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)), "mirrors"),
            (DMat3::from_diagonal(DVec3::splat(f64::NAN)), "not finite"),
        ] {
            let error = RigidTransform::new(matrix, DVec3::ZERO).unwrap_err();
            assert!(error.contains(defect), "{error}");
        }
        assert!(RigidTransform::new(DMat3::IDENTITY, DVec3::splat(1e39)).is_err());
    }
}
