//! The last slide's reflected light of one source: Lambert's term and the highlight of the half vector.

use glam::DVec3;

use crate::integrator::direct_light::IncidentLight;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::LANES;
use blinn_core::geometry::pow_one_minus;

/// The reflected light I/r² · [ k_d max(0, n·l) + k_s max(0, n·h)^p ] of a block's points.
///
/// Unlike the lecture's, the highlight counts only where n·l > 0: the irradiance is 0 elsewhere. `diffuse_weight` is a factor of
/// the diffuse term.
#[inline(always)]
pub(crate) fn blinn_phong(
    block: &mut PointBlock,
    light: &IncidentLight,
    has_specular: bool,
    diffuse_weight: &[f32; LANES],
) {
    let mut lobe = [0.0; LANES];
    if has_specular {
        for (i, lobe) in lobe.iter_mut().enumerate() {
            *lobe = specular_lobe(block.n(i), light.l(i), block.v(i), block.k.shininess[i]) as f32;
        }
    }
    for c in 0..3 {
        for (i, lobe) in lobe.iter().enumerate() {
            let diffuse = block.k.k_d[c][i] * light.n_dot_l[i] * diffuse_weight[i];
            let specular = block.k.k_s[c][i] * lobe;
            let reflected = light.irradiance[c][i] * (diffuse + specular);
            // The irradiance is 0 where n·l ≤ 0. There the other factors may be NaN.
            block.current_light[c][i] = if light.irradiance[c][i] == 0.0 { 0.0 } else { reflected };
        }
    }
}

/// The lecture's specular lobe max(0, n·h)^p of unit vectors n, l and v, with the half vector h = (v + l)/‖v + l‖.
///
/// Near n·h = 1, where a narrow lobe needs precision, a dot product has lost its digits. The sine has them: for an h of any
/// length, (n·h)² = 1 − |n × h|²/|h|². This also saves the square root of the normalisation.
#[inline(always)]
pub fn specular_lobe(n: DVec3, l: DVec3, v: DVec3, p: f32) -> f64 {
    let h = v + l;
    let h2 = h.length_squared();
    let sin2 = n.cross(h).length_squared() / h2;
    // max(0, n·h): behind the surface the cosine is 0.
    let one_minus_cos2 = if n.dot(h) > 0.0 { sin2.min(1.0) } else { 1.0 };
    let lobe = pow_one_minus(one_minus_cos2, 0.5 * f64::from(p));
    if h2 > 0.0 { lobe } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_specular_lobe_is_the_cosine_to_the_power_p() {
        for p in [10.0f32, 100.0, 1000.0] {
            for step in 0..900 {
                // v and l mirror each other about a direction at `angle` to n, which is h.
                let angle = f64::from(step) * 0.1f64.to_radians();
                let expected = angle.cos().powf(f64::from(p));
                let n = DVec3::Z;
                let direction = |a: f64| DVec3::new(a.sin(), 0.0, a.cos());
                let lobe = specular_lobe(n, direction(angle + 0.4), direction(angle - 0.4), p);
                if expected > 1e-3 {
                    assert!((lobe / expected - 1.0).abs() < 1e-5, "p {p}, {step}/10 degrees");
                } else {
                    assert!(lobe < 1.1e-3);
                }
            }
        }
    }

    #[test]
    fn a_half_vector_behind_the_surface_reflects_nothing() {
        assert_eq!(specular_lobe(DVec3::Z, DVec3::NEG_Z, DVec3::NEG_Z, 10.0), 0.0);
        assert_eq!(specular_lobe(DVec3::Z, DVec3::X, DVec3::NEG_X, 10.0), 0.0);
    }
}
