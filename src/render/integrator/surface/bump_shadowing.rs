//! Shadows that the bumps of a normal map cast on matte light (Conty Estevez, Lecocq and Stein, “A Microfacet-Based
//! Shadowing Function to Solve the Bump Terminator Problem”, Ray Tracing Gems, chapter 12).

use glam::DVec3;

/// Returns the share of the light from direction `l` that reaches a matte surface with vertex normal `n_v` and mapped normal
/// `n`: 0 from below the surface without its map, and 1 without a map. All are unit vectors.
///
/// A hemisphere around a mapped normal reaches below the surface, from where no light comes: grooves are dark. Cycles has the
/// same term.
#[inline(always)]
pub(crate) fn bump_shadowing(n: DVec3, n_v: DVec3, l: DVec3) -> f32 {
    /// Variance of the slopes of bumps, relative to the squared tangent of the angle between the normals.
    const SLOPE_VARIANCE: f64 = 0.125;
    let tan2 = |cos: f64| 1.0 / (cos * cos) - 1.0;
    let cos = n_v.dot(l);
    // Normals in a right angle: infinity, and 1.
    let alpha2 = (SLOPE_VARIANCE * tan2(n_v.dot(n))).min(1.0);
    let share = (2.0 / (1.0 + (1.0 + alpha2 * tan2(cos).max(0.0)).sqrt())) as f32;
    let share = if cos > 0.0 { share } else { 0.0 };
    if n == n_v { 1.0 } else { share }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(angle: f64) -> DVec3 {
        DVec3::new(angle.sin(), 0.0, angle.cos())
    }

    #[test]
    fn surfaces_without_bumps_receive_all_light() {
        for l in [at(0.0), at(1.5), at(3.0)] {
            assert_eq!(bump_shadowing(at(0.3), at(0.3), l), 1.0);
        }
    }

    #[test]
    fn no_light_comes_from_below_the_surface_without_its_map() {
        assert_eq!(bump_shadowing(at(1.2), DVec3::Z, at(1.6)), 0.0);
        assert_eq!(bump_shadowing(at(1.2), DVec3::Z, DVec3::X), 0.0);
    }

    /// Smith's masking of GGX with α² = tan²(normals) / 8.
    #[test]
    fn bumps_shadow_grazing_light() {
        let expected = |normals: f64, light: f64| {
            let alpha2 = normals.tan().powi(2) / 8.0;
            2.0 / (1.0 + (1.0 + alpha2 * light.tan().powi(2)).sqrt())
        };
        for (normals, light) in [(0.2, 0.0), (0.2, 1.3), (0.9, 1.0), (0.9, 1.5)] {
            let share = bump_shadowing(at(normals), DVec3::Z, at(light));
            assert!((f64::from(share) - expected(normals, light)).abs() < 1e-6, "{normals} {light}: {share}");
        }
        assert!(bump_shadowing(at(0.2), DVec3::Z, at(1.3)) > 0.97);
        assert!(bump_shadowing(at(0.9), DVec3::Z, at(1.5)) < 0.5);
        // Opposite normals, too.
        assert!(bump_shadowing(at(3.0), DVec3::Z, at(1.0)).is_finite());
        assert_eq!(bump_shadowing(DVec3::X, DVec3::Z, DVec3::Z), 1.0);
    }
}
