//! Affine transforms in f64 for points, directions and normals, with the winding of triangles.

use glam::{DAffine3, DMat3, DVec3, Vec3};

/// Returns the cofactor matrix `det(m)·m⁻ᵀ`. It transforms normals without inverting, also for
/// singular matrices. A negative determinant turns the normals with the winding.
pub fn cofactor(m: DMat3) -> DMat3 {
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis))
}

/// Returns true if the transform swaps handedness.
fn mirrors(affine: &DAffine3) -> bool {
    affine.matrix3.determinant() < 0.0
}

/// A local-to-world transform prepared for points, directions and normals.
#[derive(Clone, Copy, Debug)]
pub struct Transform {
    /// Local to world.
    pub affine: DAffine3,
    /// Transforms normals: the cofactor matrix times the sign of the determinant, which keeps a
    /// normal on the same side of its surface.
    normal: DMat3,
    /// True where the winding order is reversed: where the transform mirrors, unless
    /// [`Transform::with_winding_of`] decides.
    pub flips_winding: bool,
}

impl Transform {
    /// Prepares `affine`.
    pub fn new(affine: DAffine3) -> Transform {
        let flips_winding = mirrors(&affine);
        let sign = if flips_winding { -1.0 } else { 1.0 };
        Transform { affine, normal: cofactor(affine.matrix3) * sign, flips_winding }
    }

    /// Returns this transform with the winding order of `other`.
    pub fn with_winding_of(self, other: &DAffine3) -> Transform {
        Transform { flips_winding: mirrors(other), ..self }
    }

    /// Transforms a point and rounds it once to f32.
    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.affine.transform_point3(p.as_dvec3()).as_vec3()
    }

    /// Transforms a point in f64.
    #[inline]
    pub fn point_f64(&self, p: Vec3) -> DVec3 {
        self.affine.transform_point3(p.as_dvec3())
    }

    /// Transforms a direction, such as a tangent. Does not normalise.
    #[inline]
    pub fn vector(&self, v: Vec3) -> DVec3 {
        self.affine.transform_vector3(v.as_dvec3())
    }

    /// Transforms a normal. Does not normalise. A mirrored normal stays on the same side of the
    /// mirrored surface.
    #[inline]
    pub fn normal(&self, n: Vec3) -> DVec3 {
        self.normal * n.as_dvec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn normals_stay_perpendicular_under_shear_and_mirroring() {
        for scale in [DVec3::new(3.0, 0.2, 1.0), DVec3::new(-3.0, 0.2, 1.0)] {
            let a = DAffine3::from_scale_rotation_translation(scale, DQuat::from_rotation_z(0.7), DVec3::ONE);
            let t = Transform::new(a);
            assert_eq!(t.flips_winding, scale.x < 0.0);
            let (tangent, n) = (Vec3::new(1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0));
            assert!(t.vector(tangent).dot(t.normal(n)).abs() < 1e-12);
            // The normal is on the same side of the surface as before.
            assert!(t.vector(n).dot(t.normal(n)) > 0.0);
        }
    }

    #[test]
    fn a_singular_transform_still_transforms_normals() {
        let t = Transform::new(DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)));
        assert!(t.normal(Vec3::Y).normalize().abs_diff_eq(DVec3::Y, 1e-12));
    }
}
