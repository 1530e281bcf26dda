//! Poses of cameras: positions and axes from matrices and quaternions.

use glam::{DMat3, DVec3};

use blinn_core::geometry::Basis;

/// Largest number that computations leave in a camera's matrix or lens where 0 or 1 is exact: it moves no point of a
/// picture by a hundredth of a pixel.
pub const NEGLIGIBLE: f64 = 1e-6;

/// The axes of camera space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraAxes {
    /// x right, y up, z backward: glTF, Blender, NeRF.
    OpenGl,
    /// x right, y down, z forward: COLMAP, BOP, OpenCV.
    OpenCv,
}

/// A rotation with a uniform scale, and a translation: x ↦ s R x + t. R may deviate from a rotation by the rounding of a
/// file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimilarityTransform {
    linear: DMat3,
    translation: DVec3,
}

/// Largest relative deviation of the columns' lengths from each other, and of their scalar products from 0.
const TOLERANCE: f64 = 1e-2;
/// Farthest position from the origin in metres: coordinates are single precision.
pub const FARTHEST: f64 = f32::MAX as f64;

/// Predicate of a matrix with NaN or an infinity.
const NOT_FINITE: &str = "has a number that is not finite";

impl SimilarityTransform {
    /// The transform that changes nothing.
    pub const IDENTITY: SimilarityTransform =
        SimilarityTransform { linear: DMat3::IDENTITY, translation: DVec3::ZERO };

    /// Builds the transform.
    ///
    /// # Errors
    /// The matrix mirrors, shears, scales one axis more than another, or has numbers that are not finite. The text is
    /// the predicate of a sentence.
    pub fn new(linear: DMat3, translation: DVec3) -> Result<SimilarityTransform, String> {
        if !linear.is_finite() || !translation.is_finite() {
            return Err(NOT_FINITE.into());
        }
        let lengths = [linear.x_axis, linear.y_axis, linear.z_axis].map(DVec3::length);
        let scale = mean_length(&linear);
        let is_even = lengths.iter().all(|length| (length - scale).abs() <= TOLERANCE * scale);
        if !(is_even && scale.is_normal() && (1.0 / scale).is_normal()) {
            let [a, b, c] = lengths;
            return Err(format!(
                "is not a rotation: its columns have lengths {a:.4}, {b:.4} and {c:.4} instead of 1; remove the scale"
            ));
        }
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis].map(|axis| axis / scale);
        if [x.dot(y), y.dot(z), z.dot(x)].iter().any(|dot| dot.abs() > TOLERANCE) {
            return Err("is not a rotation: its columns are not perpendicular to each other".into());
        }
        if x.cross(y).dot(z) < 0.0 {
            return Err("mirrors: its determinant is −1; swap or negate an axis".into());
        }
        if translation.abs().max_element() > FARTHEST {
            return Err("is too far from the origin for single precision".into());
        }
        Ok(SimilarityTransform { linear, translation })
    }

    /// Builds the transform of a 4×4 or 3×4 matrix, row by row.
    ///
    /// # Errors
    /// As for [`SimilarityTransform::new`]; the last row is not 0, 0, 0, 1.
    pub fn from_rows(m: &[f64]) -> Result<SimilarityTransform, String> {
        if m.iter().any(|number| !number.is_finite()) {
            return Err(NOT_FINITE.into());
        }
        let (rows, last) = match m.len() {
            12 => (m, [0.0, 0.0, 0.0, 1.0]),
            16 => (&m[..12], [m[12], m[13], m[14], m[15]]),
            _ => return Err("must have 4×4 or 3×4 numbers".into()),
        };
        if !is_homogeneous(last) {
            return Err("must have the last row 0, 0, 0, 1; is it transposed?".into());
        }
        let column = |j: usize| DVec3::new(rows[j], rows[4 + j], rows[8 + j]);
        SimilarityTransform::new(DMat3::from_cols(column(0), column(1), column(2)), column(3))
    }

    /// Builds the transform of a quaternion w, x, y, z of any length and a translation.
    ///
    /// # Errors
    /// The quaternion is 0, or a number is not finite.
    pub fn from_quaternion(
        [w, x, y, z]: [f64; 4],
        translation: DVec3,
    ) -> Result<SimilarityTransform, String> {
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
        SimilarityTransform::new(rotation, translation).map_err(|defect| format!("the pose {defect}"))
    }

    /// The inverse of the matrix, exact also where R is rounded.
    pub fn inverse(&self) -> SimilarityTransform {
        let linear = self.linear.inverse();
        SimilarityTransform { linear, translation: -(linear * self.translation) }
    }

    /// Position and axes of a camera with this camera-to-world transform. A scale has no effect: it is that of camera
    /// space.
    pub fn camera_pose(&self, axes: CameraAxes) -> (DVec3, Basis) {
        let scale = mean_length(&self.linear);
        // The rounding of a file stays, so that its own pictures have the same bytes.
        let scale = if (scale - 1.0).abs() <= TOLERANCE { 1.0 } else { scale };
        let axis = |axis: DVec3| if scale == 1.0 { axis } else { axis / scale };
        let [x, y, z] = [self.linear.x_axis, self.linear.y_axis, self.linear.z_axis].map(axis);
        let basis = match axes {
            CameraAxes::OpenGl => Basis { u: x, v: y, w: z },
            CameraAxes::OpenCv => Basis { u: x, v: -y, w: -z },
        };
        (self.translation, basis)
    }
}

/// Returns true if a row is 0, 0, 0, 1 but for what computations leave.
pub fn is_homogeneous([x, y, z, w]: [f64; 4]) -> bool {
    [x, y, z, w - 1.0].iter().all(|v| v.abs() <= NEGLIGIBLE)
}

fn mean_length(m: &DMat3) -> f64 {
    (m.x_axis.length() + m.y_axis.length() + m.z_axis.length()) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_rotate_about_their_axes() {
        let half = 0.5f64.sqrt();
        let pose = SimilarityTransform::from_quaternion([half, 0.0, half, 0.0], DVec3::ONE).unwrap();
        assert!((pose.linear * DVec3::Z).abs_diff_eq(DVec3::X, 1e-15));
        let back = pose.inverse();
        let p = DVec3::new(3.0, -2.0, 0.5);
        let there = pose.linear * p + pose.translation;
        assert!((back.linear * there + back.translation).abs_diff_eq(p, 1e-14));
        assert!(SimilarityTransform::from_quaternion([0.0; 4], DVec3::ZERO).is_err());
        assert!(SimilarityTransform::from_quaternion([f64::NAN, 0.0, 0.0, 1.0], DVec3::ZERO).is_err());
    }

    #[test]
    fn cameras_look_along_their_conventions() {
        let pose = SimilarityTransform { linear: DMat3::IDENTITY, translation: DVec3::X };
        assert_eq!(pose.camera_pose(CameraAxes::OpenGl).1.w, DVec3::Z);
        let (e, basis) = pose.camera_pose(CameraAxes::OpenCv);
        assert_eq!((e, basis.u, basis.v, basis.w), (DVec3::X, DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z));
    }

    #[test]
    fn a_uniform_scale_does_not_change_a_camera() {
        let rotation = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1);
        let t = DVec3::new(3.0, -2.0, 0.5);
        let to_world = SimilarityTransform::new(rotation, t).unwrap();
        let (e, basis) = to_world.camera_pose(CameraAxes::OpenGl);
        for scale in [1e-3, 0.1, 25.4, 1000.0] {
            let scaled = SimilarityTransform::new(rotation * scale, t).unwrap();
            // The inverse of a scaled camera-to-world matrix is a world-to-camera matrix with the inverse scale.
            for pose in [scaled, scaled.inverse().inverse()] {
                let (position, axes) = pose.camera_pose(CameraAxes::OpenGl);
                assert!(position.abs_diff_eq(e, 1e-12), "{scale}: {position}");
                for (a, b) in [(axes.u, basis.u), (axes.v, basis.v), (axes.w, basis.w)] {
                    assert!(a.abs_diff_eq(b, 1e-12), "{scale}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn last_rows_are_exact_but_for_rounding() {
        let rows = |last: [f64; 4]| {
            [&[1.0, 0.0, 0.0, 5.0, 0.0, 1.0, 0.0, 6.0, 0.0, 0.0, 1.0, 7.0], &last[..]].concat()
        };
        for last in
            [[0.0, 0.0, 0.0, 1.0], [1e-17, 0.0, -3e-9, 0.999_999_999_999_999_8], [0.0, 1e-7, 0.0, 1.0000001]]
        {
            let pose = SimilarityTransform::from_rows(&rows(last)).unwrap();
            assert_eq!(pose.translation, DVec3::new(5.0, 6.0, 7.0), "{last:?}");
        }
        for (last, defect) in [
            ([5.0, 6.0, 7.0, 1.0], "transposed"),
            ([0.0, 0.0, 0.0, 2.0], "transposed"),
            ([0.0, 1e-3, 0.0, 1.0], "transposed"),
            ([0.0, 0.0, f64::NAN, 1.0], "not finite"),
            ([f64::INFINITY, 0.0, 0.0, 1.0], "not finite"),
        ] {
            let error = SimilarityTransform::from_rows(&rows(last)).unwrap_err();
            assert!(error.contains(defect), "{last:?}: {error}");
        }
    }

    #[test]
    fn stretched_sheared_mirrored_and_infinite_matrices_are_refused() {
        let columns = DMat3::from_cols;
        for (matrix, defect) in [
            (DMat3::from_diagonal(DVec3::new(2.0, 1.0, 1.0)), "lengths 2.0000"),
            (DMat3::ZERO, "lengths 0.0000"),
            (columns(DVec3::X, DVec3::new(0.6, 0.8, 0.0), DVec3::Z), "not perpendicular"),
            (columns(DVec3::X, DVec3::X, DVec3::Z), "not perpendicular"),
            (DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)), "mirrors"),
            (DMat3::from_diagonal(DVec3::splat(f64::NAN)), "not finite"),
        ] {
            let error = SimilarityTransform::new(matrix, DVec3::ZERO).unwrap_err();
            assert!(error.contains(defect), "{error}");
        }
        assert!(SimilarityTransform::new(DMat3::IDENTITY, DVec3::splat(1e39)).is_err());
    }
}
