//! The lecture's orthonormal camera basis.

use glam::{DMat3, DVec3};

/// The camera basis of the lecture: `u` to the right, `v` up, `w` against the view direction.
/// All unit length, mutually perpendicular and right-handed, but for a file's camera below what mirrors or
/// shears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis {
    /// To the right in the picture.
    pub u: DVec3,
    /// Up in the picture.
    pub v: DVec3,
    /// Backwards: opposite to the view direction.
    pub w: DVec3,
}

impl Basis {
    /// `w = −normalize(view_dir)`, `u = normalize(view_up × w)`, `v = w × u`.
    ///
    /// `None` where the view direction has no length, or `view_up` is parallel to it
    /// (within a millionth of a radian), or anything is not finite.
    pub fn from_view(view_dir: DVec3, view_up: DVec3) -> Option<Basis> {
        let w = -view_dir.try_normalize()?;
        let side = view_up.try_normalize()?.cross(w);
        if !(side.length() > 1e-6) {
            return None;
        }
        let u = side.normalize();
        Some(Basis { u, v: w.cross(u), w })
    }

    /// The axes of what `to_world` places, as long as one: mirrored and sheared where it does that. `None`
    /// where they do not span space.
    pub fn from_transform(to_world: DMat3) -> Option<Basis> {
        let [u, v, w] = [to_world.x_axis, to_world.y_axis, to_world.z_axis].map(DVec3::try_normalize);
        let basis = Basis { u: u?, v: v?, w: w? };
        (basis.volume().abs() > 1e-6).then_some(basis)
    }

    /// False where the axes shear or mirror.
    pub fn is_orthonormal(&self) -> bool {
        (self.volume() - 1.0).abs() <= 1e-9
    }

    /// What u, v and w span: 1 where they are the lecture's, less where they shear, below 0 where they mirror.
    fn volume(&self) -> f64 {
        self.u.cross(self.v).dot(self.w)
    }

    /// Like [`Basis::from_view`], falling back to the up direction −Z, then +Y, where `view_up`
    /// will not do. `None` only where the view direction itself has no length.
    pub fn from_view_with_fallback_up(view_dir: DVec3, view_up: DVec3) -> Option<Basis> {
        [view_up, DVec3::NEG_Z, DVec3::Y].into_iter().find_map(|up| Basis::from_view(view_dir, up))
    }
}

/// Two unit vectors that complete the unit vector `n` to a right-handed frame (Duff et al.,
/// "Building an Orthonormal Basis, Revisited", JCGT 2017).
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
    fn the_basis_is_the_lectures() {
        let b = Basis::from_view(DVec3::new(0.0, 0.0, -2.0), DVec3::new(0.0, 3.0, 1.0)).unwrap();
        assert_eq!((b.u, b.v, b.w), (DVec3::X, DVec3::Y, DVec3::Z));
    }

    #[test]
    fn a_parallel_up_is_refused_and_then_replaced() {
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
