//! The equal-area octahedral map between unit directions and the unit square (Clarberg, “Fast Equal-Area Mapping of the
//! (Hemi)Sphere using SIMD”, Journal of Graphics Tools 2008; pbrt-v4, section 3.8.3).
//!
//! All texels have the same solid angle, so the mean of texels is the mean of radiance. The pole of the map is +Y.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec3, Vec2, Vec3};

/// Coefficients of P in (2/π) atan t ≈ t P(t²) for t in 0…1; the error is below 2e-7.
const ATAN: [f32; 7] =
    [0.636_617_1, -0.212_100_1, 0.126_055_82, -0.084_073, 0.050_368_63, -0.021_109_996, 0.004_241_501_4];

/// Returns the angle of the vector (x, y) in quarter turns, 0…1, for x ≥ 0 and y ≥ 0. It uses no function whose result
/// depends on the platform.
#[inline(always)]
pub(super) fn quadrant_angle(x: f32, y: f32) -> f32 {
    let (low, high) = (x.min(y), x.max(y));
    let t = if high > 0.0 { low / high } else { 0.0 };
    let t2 = t * t;
    let p = ATAN.iter().rev().fold(0.0, |sum, c| sum * t2 + c) * t;
    if y > x { 1.0 - p } else { p }
}

/// Returns the point of the unit square for the unit direction `d`.
#[inline(always)]
pub(super) fn to_square(d: Vec3) -> Vec2 {
    let a = d.abs();
    // √(1 − |y|), without cancellation near the pole.
    let r = ((a.x * a.x + a.z * a.z) / (1.0 + a.y)).sqrt().min(1.0);
    let v = quadrant_angle(a.x, a.z) * r;
    let upper = Vec2::new(r - v, v);
    let p = if d.y < 0.0 { Vec2::ONE - Vec2::new(upper.y, upper.x) } else { upper };
    let signed = Vec2::new(p.x.copysign(d.x), p.y.copysign(d.z));
    (signed + Vec2::ONE) * 0.5
}

/// Returns the unit direction of a point of the unit square: the inverse of [`to_square`].
pub(super) fn to_direction(x: f64, y: f64) -> DVec3 {
    let (u, v) = (2.0 * x - 1.0, 2.0 * y - 1.0);
    let (a, b) = (u.abs(), v.abs());
    let distance = 1.0 - (a + b);
    let r = 1.0 - distance.abs();
    let angle = if r == 0.0 { 0.0 } else { ((b - a) / r + 1.0) * 0.5 * FRAC_PI_2 };
    let scale = r * (2.0 - r * r).max(0.0).sqrt();
    DVec3::new(
        (libm::cos(angle) * scale).copysign(u),
        (1.0 - r * r).copysign(distance),
        (libm::sin(angle) * scale).copysign(v),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_agree_with_libm() {
        for i in 0..=2000 {
            let angle = f64::from(i) / 2000.0 * FRAC_PI_2;
            let found = quadrant_angle(libm::cos(angle) as f32, libm::sin(angle) as f32);
            assert!((f64::from(found) - angle / FRAC_PI_2).abs() < 4e-7, "{angle}: {found}");
        }
    }

    #[test]
    fn directions_and_points_are_inverse() {
        for i in 0..64 {
            for j in 0..64 {
                let (x, y) = ((f64::from(i) + 0.37) / 64.0, (f64::from(j) + 0.71) / 64.0);
                let d = to_direction(x, y);
                assert!((d.length() - 1.0).abs() < 1e-12);
                let p = to_square(d.as_vec3()).as_dvec2();
                assert!((p.x - x).abs() < 2e-6 && (p.y - y).abs() < 2e-6, "{x} {y}: {p}");
            }
        }
    }

    /// The solid angle of a small square, by the cross product of its edges.
    #[test]
    fn all_points_have_the_same_solid_angle() {
        let h = 1e-4;
        for i in 0..24 {
            for j in 0..24 {
                let (x, y) = ((f64::from(i) + 0.4) / 24.0, (f64::from(j) + 0.3) / 24.0);
                let dx = to_direction(x + h, y) - to_direction(x - h, y);
                let dy = to_direction(x, y + h) - to_direction(x, y - h);
                let density = dx.cross(dy).length() / (4.0 * h * h);
                assert!((density / (4.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3, "{x} {y}: {density}");
            }
        }
    }
}
