//! The GGX lobe in which a surface reflects a light source.

use glam::DVec3;

use crate::integrator::material::fresnel::schlick_weight;

/// Smallest cosine between normal and viewer.
const MIN_COS: f64 = 1e-3;

/// π D G₂ / (4 n·v) of a GGX lobe, and Schlick's weight of the half vector h = (v + l)/‖v + l‖. The first times the reflectance
/// F and the lecture's irradiance I/r² is the reflected light: the factor n·l is in it, and π because the lecture's
/// coefficients leave out 1/π.
///
/// G₂ is Smith's height-correlated shadowing. `a2` is α². For n·l > 0.
#[inline(always)]
pub(crate) fn highlight_lobe(n: DVec3, l: DVec3, v: DVec3, a2: f64) -> [f64; 2] {
    let h = v + l;
    let h2 = h.length_squared();
    // The sine of the angle between n and h keeps its digits in narrow lobes.
    let sin2 = (n.cross(h).length_squared() / h2).min(1.0);
    let d = sin2 + a2 * (1.0 - sin2);
    let (n_l, n_v) = (n.dot(l).min(1.0), n.dot(v).clamp(MIN_COS, 1.0));
    // cos √(1 + α² tan²) of both directions.
    let [stretched_l, stretched_v] = [n_l, n_v].map(|cos| (cos * cos + a2 * (1.0 - cos * cos)).sqrt());
    let lobe = a2 * n_l / (2.0 * d * d * (n_l * stretched_v + n_v * stretched_l));
    let v_h = 0.5 * h2.sqrt();
    if h2 > 0.0 { [lobe, schlick_weight(v_h)] } else { [0.0; 2] }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;
    use crate::geometry::Rgb;
    use crate::integrator::material::directional_albedo::FacetAlbedo;

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
                let [lobe, _] = highlight_lobe(DVec3::Z, l, v, alpha * alpha);
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
        let [_, weight] = highlight_lobe(DVec3::Z, l, v, 0.25);
        assert!((weight - (1.0 - 0.5f64.cos()).powi(5)).abs() < 1e-12, "{weight}");
    }

    #[test]
    fn directions_without_a_half_vector_reflect_nothing() {
        assert_eq!(highlight_lobe(DVec3::Z, DVec3::X, DVec3::NEG_X, 0.25), [0.0; 2]);
        let [lobe, _] = highlight_lobe(DVec3::Z, DVec3::X + DVec3::Z * 1e-12, DVec3::X, 1e-4);
        assert!(lobe.is_finite(), "{lobe}");
    }
}
