//! Rotations about an axis, for turntables that rotate the scene in front of the camera.

use glam::{DAffine3, DMat3, DVec3};

use super::Camera;
use blinn_core::geometry::Basis;

/// A rotation about an axis through a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisRotation {
    /// Axis of unit length.
    pub axis: DVec3,
    /// A point on the axis, in world coordinates.
    pub pivot: DVec3,
    /// Angle in radians, counter-clockwise seen from the tip of the axis.
    pub angle: f64,
}

impl AxisRotation {
    /// Returns the rotation as an affine transform. Angle 0 gives exactly the identity, and a coordinate
    /// axis is mapped exactly to itself by rotations about it.
    pub fn to_affine(&self) -> DAffine3 {
        if self.angle == 0.0 {
            return DAffine3::IDENTITY;
        }
        let (sin, cos) = (libm::sin(self.angle), libm::cos(self.angle));
        let turned = |v: DVec3| {
            let along = self.axis * self.axis.dot(v);
            let across = v - along;
            along + across * cos + self.axis.cross(across) * sin
        };
        let matrix3 = DMat3::from_cols(turned(DVec3::X), turned(DVec3::Y), turned(DVec3::Z));
        DAffine3 { matrix3, translation: self.pivot - matrix3 * self.pivot }
    }
}

impl Camera {
    /// Returns this camera moved by a rigid motion.
    pub fn transformed(&self, motion: &DAffine3) -> Camera {
        let turned = |v: DVec3| motion.matrix3 * v;
        let Basis { u, v, w } = self.basis;
        let basis = Basis { u: turned(u), v: turned(v), w: turned(w) };
        Camera { view_point: motion.transform_point3(self.view_point), basis, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, TAU};

    #[test]
    fn a_quarter_turn_about_y_moves_the_front_to_the_right() {
        let turn = AxisRotation { axis: DVec3::Y, pivot: DVec3::new(1.0, 5.0, 2.0), angle: FRAC_PI_2 };
        let moved = turn.to_affine().transform_point3(DVec3::new(1.0, 7.0, 3.0));
        assert!(moved.abs_diff_eq(DVec3::new(2.0, 7.0, 2.0), 1e-15), "{moved}");
    }

    #[test]
    fn rotations_keep_their_axis_and_angle_zero_is_the_identity() {
        for i in 0..36 {
            let angle = TAU * f64::from(i) / 36.0;
            let motion = AxisRotation { axis: DVec3::Y, pivot: DVec3::new(0.1, 0.2, 0.3), angle }.to_affine();
            assert_eq!(motion.matrix3 * DVec3::Y, DVec3::Y);
            assert!((motion.inverse() * motion).abs_diff_eq(DAffine3::IDENTITY, 1e-15));
        }
        let none = AxisRotation { axis: DVec3::new(0.6, 0.0, 0.8), pivot: DVec3::splat(0.1), angle: 0.0 };
        assert_eq!(none.to_affine(), DAffine3::IDENTITY);
    }
}
