//! The camera basis of the lecture, and orthonormal frames around a vector.

use glam::{DMat3, DVec3};

/// The lecture's camera basis: `u` to the right, `v` up, `w` opposite to the view direction.
///
/// The axes have unit length. They are orthonormal and right-handed, except for a camera of a file
/// whose node transform mirrors or shears.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Basis {
    /// Right in the picture.
    pub u: DVec3,
    /// Up in the picture.
    pub v: DVec3,
    /// Backwards: opposite to the view direction.
    pub w: DVec3,
}

impl Basis {
    /// Builds the basis `w = −normalize(view_dir)`, `u = normalize(view_up × w)`, `v = w × u`.
    ///
    /// Returns `None` if the view direction has no length, if `view_up` is parallel to it (within
    /// 1e-6 rad), or if a component is not finite.
    pub fn from_view(view_dir: DVec3, view_up: DVec3) -> Option<Basis> {
        let w = -view_dir.try_normalize()?;
        let side = view_up.try_normalize()?.cross(w);
        if !(side.length() > 1e-6) {
            return None;
        }
        let u = side.normalize();
        Some(Basis { u, v: w.cross(u), w })
    }

    /// Builds the basis from the normalised columns of a camera's node transform. Keeps mirroring
    /// and shear. Returns `None` if the columns do not span space.
    pub fn from_transform(to_world: DMat3) -> Option<Basis> {
        let [u, v, w] = [to_world.x_axis, to_world.y_axis, to_world.z_axis].map(DVec3::try_normalize);
        let basis = Basis { u: u?, v: v?, w: w? };
        (basis.volume().abs() > 1e-6).then_some(basis)
    }

    /// Returns true if the axes are orthonormal and right-handed, that is neither sheared nor mirrored.
    pub fn is_orthonormal(&self) -> bool {
        (self.volume() - 1.0).abs() <= 1e-9
    }

    /// The signed volume spanned by the axes: 1 if orthonormal, less if sheared, negative if mirrored.
    fn volume(&self) -> f64 {
        self.u.cross(self.v).dot(self.w)
    }

    /// Builds the basis like [`Basis::from_view`]. Where `view_up` is unusable, tries −Z, then +Y as the
    /// up direction. Returns `None` only if the view direction has no length.
    pub fn from_view_with_fallback_up(view_dir: DVec3, view_up: DVec3) -> Option<Basis> {
        [view_up, DVec3::NEG_Z, DVec3::Y].into_iter().find_map(|up| Basis::from_view(view_dir, up))
    }
}

/// Returns two unit vectors that complete the unit vector `n` to a right-handed frame (Duff et al.,
/// “Building an Orthonormal Basis, Revisited”, JCGT 2017).
#[inline(always)]
pub fn coordinate_system(n: DVec3) -> (DVec3, DVec3) {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_view_builds_the_lectures_basis() {
        let b = Basis::from_view(DVec3::new(0.0, 0.0, -2.0), DVec3::new(0.0, 3.0, 1.0)).unwrap();
        assert_eq!((b.u, b.v, b.w), (DVec3::X, DVec3::Y, DVec3::Z));
    }

    #[test]
    fn a_parallel_up_vector_is_rejected_or_replaced() {
        let down = DVec3::NEG_Y;
        assert!(Basis::from_view(down, DVec3::Y).is_none());
        let b = Basis::from_view_with_fallback_up(down, DVec3::Y).unwrap();
        assert_eq!(b.v, DVec3::NEG_Z);
        assert!(Basis::from_view_with_fallback_up(DVec3::ZERO, DVec3::Y).is_none());
    }

    #[test]
    fn coordinate_systems_are_right_handed() {
        for n in [DVec3::Z, DVec3::NEG_Z, DVec3::new(0.6, -0.48, 0.64)] {
            let (a, b) = coordinate_system(n);
            assert!((a.cross(b) - n).length() < 1e-14 && a.dot(n).abs() < 1e-14);
        }
    }
}
