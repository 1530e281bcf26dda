//! The normal of specular lobes: a shading normal turned so that the mirror's direction is above the triangle.

use glam::DVec3;

/// Least cosine between the mirror's direction and the geometric normal, or 0.9 n_g·v if that is less.
const MIN_MIRROR_COS: f64 = 0.01;

/// Returns `n`, or the nearest normal in the plane of `n` and the geometric normal `n_g` in which the mirrored `v` is above
/// the triangle. All are unit vectors, with n_g·v ≥ 0.
///
/// Smooth normals of coarse meshes lean far off their triangles. Lobes about them would point below the surface, whose
/// reflections would be too dark. Cycles turns normals in the same way.
#[inline(always)]
pub(crate) fn specular_normal(n: DVec3, n_g: DVec3, v: DVec3) -> DVec3 {
    let v_z = n_g.dot(v).max(0.0);
    let min_cos = MIN_MIRROR_COS.min(0.9 * v_z);
    let mirrored_cos = 2.0 * n.dot(v) * n_g.dot(n) - v_z;
    // Also a normal that is 0.
    if !(mirrored_cos < min_cos) {
        return n;
    }
    let tangent = n - n_g * n.dot(n_g);
    let Some(x) = tangent.try_normalize() else { return n };
    // With n = n_g cos φ + x sin φ, the cosine of the mirrored direction is v_z cos 2φ + v_x sin 2φ: r cos(2φ − δ) for v at
    // angle δ in this plane. The largest φ with the least cosine has 2φ = δ + acos(min_cos / r).
    let v_x = x.dot(v);
    let r = v_x.hypot(v_z);
    let cos = (min_cos / r).min(1.0);
    let sin = (1.0 - cos * cos).sqrt();
    let cos_2phi = (cos * v_z - sin * v_x) / r;
    let [n_z, n_x] = [1.0 + cos_2phi, 1.0 - cos_2phi].map(|x| (0.5 * x).max(0.0).sqrt());
    let turned = n_g * n_z + x * n_x;
    if r > 0.0 { turned } else { n }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(angle: f64) -> DVec3 {
        DVec3::new(angle.sin(), 0.0, angle.cos())
    }

    #[test]
    fn normals_that_mirror_above_the_triangle_stay() {
        assert_eq!(specular_normal(at(0.2), DVec3::Z, at(0.5)), at(0.2));
        assert_eq!(specular_normal(DVec3::Z, DVec3::Z, at(1.57)), DVec3::Z);
        assert_eq!(specular_normal(DVec3::ZERO, DVec3::Z, at(1.0)), DVec3::ZERO);
    }

    #[test]
    fn normals_that_mirror_below_turn_to_the_least_angle_that_does_not() {
        // Leaning to the viewer and away, in the plane of v and out of it.
        let leaning = DVec3::new(0.3, 0.5, 1.0).normalize();
        for (n, v) in [(at(1.2), at(0.5)), (at(-0.4), at(1.4)), (at(0.9), at(0.2)), (leaning, at(-1.5))] {
            let mirrored = |n: DVec3| n * (2.0 * n.dot(v)) - v;
            assert!(mirrored(n).z < 0.0);
            let turned = specular_normal(n, DVec3::Z, v);
            assert!((turned.length() - 1.0).abs() < 1e-12);
            assert!(
                (mirrored(turned).z - 0.01f64.min(0.9 * v.z)).abs() < 1e-9,
                "{n} {v}: {}",
                mirrored(turned)
            );
            assert!(turned.z >= n.z && turned.dot(n) > 0.0, "{turned}");
            let across = n.cross(DVec3::Z).dot(turned);
            assert!(across.abs() < 1e-12, "{across}");
        }
    }
}
