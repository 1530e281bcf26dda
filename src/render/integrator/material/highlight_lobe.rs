//! The GGX lobe in which a surface reflects a light source.

use glam::{DVec3, Vec3};

/// Smallest cosine between normal and viewer.
const MIN_COS: f32 = 1e-3;

/// Smallest difference from 1 of the ratio of two indices of refraction that scatters light.
const MIN_ETA_STEP: f64 = 1e-3;

/// π D G₂ / (4 n·v) of a GGX lobe, and Schlick's weight of the half vector h = (v + l)/‖v + l‖. The first times the reflectance
/// F and the lecture's irradiance I/r² is the reflected light: the factor n·l is in it, and π because the lecture's
/// coefficients leave out 1/π.
///
/// G₂ is Smith's height-correlated shadowing. `a2` is α², at least 10⁻⁴, and `n_l` is n·l > 0. In f32, whose rounding errors
/// change the narrowest lobe by less than 10⁻⁴ of its height.
#[inline(always)]
pub(crate) fn highlight_lobe(n: Vec3, l: Vec3, v: Vec3, n_l: f32, a2: f32) -> [f32; 2] {
    let h = v + l;
    let h2 = h.length_squared();
    // The sine of the angle between n and h keeps its digits in narrow lobes.
    let sin2 = (n.cross(h).length_squared() / h2).min(1.0);
    let d = sin2 + a2 * (1.0 - sin2);
    let (n_l, n_v) = (n_l.min(1.0), n.dot(v).clamp(MIN_COS, 1.0));
    // cos √(1 + α² tan²) of both directions.
    let [stretched_l, stretched_v] = [n_l, n_v].map(|cos| (cos * cos + a2 * (1.0 - cos * cos)).sqrt());
    let lobe = a2 * n_l / (2.0 * d * d * (n_l * stretched_v + n_v * stretched_l));
    let m = (1.0 - 0.5 * h2.sqrt()).clamp(0.0, 1.0);
    let m2 = m * m;
    if h2 > 0.0 { [lobe, m2 * m2 * m] } else { [0.0; 2] }
}

/// Density per steradian with which a ray of a GGX lobe is reflected to `l`, D G₁ / (4 n·v): that of visible normals. `a2` is α².
#[inline(always)]
pub(crate) fn reflection_pdf(n: Vec3, l: Vec3, v: Vec3, a2: f32) -> f32 {
    let h = v + l;
    let h2 = h.length_squared();
    let sin2 = (n.cross(h).length_squared() / h2).min(1.0);
    let d = sin2 + a2 * (1.0 - sin2);
    let n_v = n.dot(v).clamp(MIN_COS, 1.0);
    let stretched_v = (n_v * n_v + a2 * (1.0 - n_v * n_v)).sqrt();
    a2 / (2.0 * std::f32::consts::PI * d * d * (n_v + stretched_v))
}

/// π D G₂ times the change of the half vector with the direction of light, for light from direction `l` behind a surface that
/// microfacets refract to `v`, and the cosine v·h of incidence at them (Walter et al., “Microfacet Models for Refraction through
/// Rough Surfaces”, EGSR 2007). The first times the transmittance 1 − F and the lecture's irradiance I/r² is the transmitted
/// light: the factor |n·l| is in it. Radiance is not scaled by η².
///
/// `eta` is the index of refraction behind the surface over that in front of it. 0 where it is 1: nothing is scattered then.
pub(crate) fn transmitted_lobe(n: DVec3, l: DVec3, v: DVec3, a2: f64, eta: f64) -> [f64; 2] {
    let between = v + l * eta;
    let Some(h) = between.try_normalize().filter(|_| (eta - 1.0).abs() > MIN_ETA_STEP) else {
        return [0.0; 2];
    };
    let h = if n.dot(h) < 0.0 { -h } else { h };
    let (v_h, l_h) = (v.dot(h), l.dot(h));
    if !(v_h > 0.0 && l_h < 0.0) {
        return [0.0; 2];
    }
    let sin2 = n.cross(h).length_squared().min(1.0);
    let d = sin2 + a2 * (1.0 - sin2);
    let (n_l, n_v) = ((-n.dot(l)).clamp(MIN_COS.into(), 1.0), n.dot(v).clamp(MIN_COS.into(), 1.0));
    let [lambda_l, lambda_v] =
        [n_l, n_v].map(|cos| 0.5 * ((1.0 + a2 * (1.0 / (cos * cos) - 1.0)).sqrt() - 1.0));
    let step = v_h + eta * l_h;
    let lobe = a2 / (d * d * (1.0 + lambda_l + lambda_v)) * v_h * -l_h * eta * eta / (n_v * step * step);
    [lobe, v_h]
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;
    use crate::integrator::material::directional_albedo::FacetAlbedo;
    use blinn_core::geometry::Rgb;

    fn lobe_in_f32(n: DVec3, l: DVec3, v: DVec3, a2: f64) -> [f64; 2] {
        let [n_l, a2] = [n.dot(l), a2].map(|x| x as f32);
        highlight_lobe(n.as_vec3(), l.as_vec3(), v.as_vec3(), n_l, a2).map(f64::from)
    }

    /// The same in f64 and by another formula.
    fn exact_lobe(n: DVec3, l: DVec3, v: DVec3, a2: f64) -> [f64; 2] {
        let h = (v + l).normalize();
        let d = n.cross(h).length_squared() + a2 * n.dot(h).powi(2);
        let lambda =
            |w: DVec3| 0.5 * ((1.0 + a2 * n.cross(w).length_squared() / n.dot(w).powi(2)).sqrt() - 1.0);
        let lobe = a2 / (d * d) / (4.0 * n.dot(v) * (1.0 + lambda(l) + lambda(v)));
        [lobe, (1.0 - v.dot(h)).powi(5)]
    }

    /// Relative to the height of the lobe: π D is at most 1/α².
    #[test]
    fn f32_is_exact_to_a_ten_thousandth() {
        let n = DVec3::new(0.36, 0.48, 0.8);
        let (x, y) = n.any_orthonormal_pair();
        let direction =
            |angle: f64, turn: f64| (x * turn.cos() + y * turn.sin()) * angle.sin() + n * angle.cos();
        let mut worst = 0.0f64;
        for alpha in [0.01f64, 0.02, 0.1, 0.5, 1.0] {
            for angle in [0.0, 0.3, 0.8, 1.3] {
                for k in 0..200 {
                    // Around the mirror's direction, by up to eight times the width of the lobe.
                    let offset = 0.04 * f64::from(k) * alpha;
                    let from_normal = (angle - offset).abs().min(1.5);
                    let (v, l) = (direction(angle, 0.2), direction(from_normal, 0.2 + PI));
                    let [[lobe, weight], [exact, exact_weight]] =
                        [lobe_in_f32(n, l, v, alpha * alpha), exact_lobe(n, l, v, alpha * alpha)];
                    let [height, _] = exact_lobe(n, direction(angle, 0.2 + PI), v, alpha * alpha);
                    worst = worst.max((lobe - exact).abs() / height).max((weight - exact_weight).abs());
                }
            }
        }
        assert!(worst < 1e-4, "{worst}");
    }

    /// The mean over directions of light is the albedo E of the facets, which the tables have from another integration.
    #[test]
    fn highlights_reflect_as_much_light_as_the_lobe() {
        for (alpha, angle) in [(0.1f64, 0.3f64), (0.3, 0.9), (0.7, 0.1), (1.0, 1.2)] {
            let v = DVec3::new(angle.sin(), 0.0, angle.cos());
            let mut albedo = 0.0;
            let n = 600;
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [z, phi] = [i, j].map(|x| (f64::from(x) + 0.5) / f64::from(n));
                let r = (1.0 - z * z).sqrt();
                let l = DVec3::new(r * (TAU * phi).cos(), r * (TAU * phi).sin(), z);
                let [lobe, _] = lobe_in_f32(DVec3::Z, l, v, alpha * alpha);
                albedo += lobe / PI * TAU / f64::from(n * n);
            }
            let expected = FacetAlbedo::new(v.z as f32, alpha as f32, 1.5).metal(Rgb::ONE, Rgb::ONE);
            // With scattering between facets, the sum of both shares is 1.
            let once = f64::from(1.0 / expected.f0.x);
            assert!((albedo - once).abs() < 0.01, "{alpha} {angle}: {albedo} {once}");
        }
    }

    #[test]
    fn the_weight_is_schlicks_at_the_half_vector() {
        let [v, l] = [0.5f64, -0.5].map(|angle| DVec3::new(angle.sin(), 0.0, angle.cos()));
        let [_, weight] = lobe_in_f32(DVec3::Z, l, v, 0.25);
        assert!((weight - (1.0 - 0.5f64.cos()).powi(5)).abs() < 1e-7, "{weight}");
    }

    /// The mean over directions of light behind the surface is the share of light that the facets let through, apart from
    /// Fresnel's reflectance. The expected values are means of G₂/G₁ over 400,000 visible normals, whose refracted directions leave
    /// the surface (docs/decisions/glass.md).
    #[test]
    fn transmitted_lobes_have_the_energy_of_sampled_microfacets() {
        let cases = [
            (0.3, 0.3, 1.5, 0.998),
            (0.3, 0.9, 1.5, 0.986),
            (0.7, 0.1, 1.5, 0.987),
            (0.3, 0.2, 1.0 / 1.5, 0.884),
        ];
        for (alpha, angle, eta, expected) in cases {
            let v = DVec3::new(f64::sin(angle), 0.0, f64::cos(angle));
            let mut sum = 0.0;
            let n = 600;
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [z, phi] = [i, j].map(|x| (f64::from(x) + 0.5) / f64::from(n));
                let r = (1.0 - z * z).sqrt();
                let l = DVec3::new(r * (TAU * phi).cos(), r * (TAU * phi).sin(), -z);
                let [lobe, _] = transmitted_lobe(DVec3::Z, l, v, alpha * alpha, eta);
                sum += lobe / PI * TAU / f64::from(n * n);
            }
            assert!((sum - expected).abs() < 0.004, "{alpha} {angle} {eta}: {sum} {expected}");
        }
    }

    /// Without a change of the index of refraction nothing is scattered, and light in front of the surface is not transmitted.
    #[test]
    fn light_passes_straight_where_the_index_does_not_change() {
        assert_eq!(transmitted_lobe(DVec3::Z, DVec3::NEG_Z, DVec3::Z, 0.1, 1.0), [0.0; 2]);
        assert_eq!(transmitted_lobe(DVec3::Z, DVec3::Z, DVec3::Z, 0.1, 1.5), [0.0; 2]);
    }

    #[test]
    fn directions_without_a_half_vector_reflect_nothing() {
        assert_eq!(lobe_in_f32(DVec3::Z, DVec3::X, DVec3::NEG_X, 0.25), [0.0; 2]);
        let [lobe, _] = lobe_in_f32(DVec3::Z, DVec3::X + DVec3::Z * 1e-12, DVec3::X, 1e-4);
        assert!(lobe.is_finite(), "{lobe}");
    }
}
