//! The GGX distribution of microfacets, with Smith's shadowing and visible normals.
//!
//! Directions are in the local frame of the surface: z is the normal. α is the square of the perceptual roughness.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// Samples a microfacet normal visible from the unit direction `v`, v.z > 0, given a point `u` of the unit square (Dupuy
/// and Benyoub, “Sampling Visible GGX Normals with Spherical Caps”, 2023). The light that it reflects goes to
/// 2(v·h)h − v. The density of that direction is [`reflected_pdf`], and the share of light that leaves the surface, for
/// facets that reflect everything, is [`shadowing_ratio`].
#[inline(always)]
pub(crate) fn sample_visible_normal(v: DVec3, alpha: f64, u: [f64; 2]) -> DVec3 {
    let phi = TAU * u[0];
    sample_visible_normal_at(v, alpha, [libm::cos(phi), libm::sin(phi)], u[1])
}

/// [`sample_visible_normal`] with the cosine and the sine of 2π u₀.
#[inline(always)]
pub(crate) fn sample_visible_normal_at(v: DVec3, alpha: f64, [cos, sin]: [f64; 2], u: f64) -> DVec3 {
    // The hemisphere of a roughness of 1, to which the distribution is stretched.
    let stretched = DVec3::new(v.x * alpha, v.y * alpha, v.z);
    let w = stretched * stretched.length_recip();
    let z = (1.0 - u) * (1.0 + w.z) - w.z;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let h = DVec3::new(r * cos, r * sin, z) + w;
    let h = DVec3::new(h.x * alpha, h.y * alpha, h.z.max(0.0));
    let length = h.length();
    if length > 0.0 { h / length } else { DVec3::Z }
}

/// Λ of Smith's shadowing for a direction at cosine `cos` > 0 to the normal.
#[inline(always)]
fn smith_lambda(cos: f64, alpha: f64) -> f64 {
    let cos2 = cos * cos;
    let tan2 = (1.0 - cos2).max(0.0) / cos2;
    0.5 * ((1.0 + alpha * alpha * tan2).sqrt() - 1.0)
}

/// G2/G1, height-correlated: the share of the light reflected by the facets visible from `v_z` that leaves towards `l_z`
/// (cosines to the normal); 0 below the horizon.
#[inline(always)]
pub(crate) fn shadowing_ratio(v_z: f64, l_z: f64, alpha: f64) -> f64 {
    if l_z <= 0.0 {
        return 0.0;
    }
    let v = 1.0 + smith_lambda(v_z, alpha);
    v / (v + smith_lambda(l_z, alpha))
}

/// Density of normals D(h).
#[inline(always)]
fn distribution(h_z: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let c2 = h_z * h_z;
    // 1 − c² + α² c², without the loss of digits near c = 1 mattering: lobes of tiny α are looked up as mirrors.
    let d = (1.0 - c2) + a2 * c2;
    a2 / (PI * d * d)
}

/// Density per solid angle of the reflected direction of a visible normal `h`, seen from `v`: D G1 / (4 n·v).
#[inline(always)]
pub(crate) fn reflected_pdf(v_z: f64, h_z: f64, alpha: f64) -> f64 {
    distribution(h_z, alpha) / ((1.0 + smith_lambda(v_z, alpha)) * 4.0 * v_z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: usize) -> impl Iterator<Item = [f64; 2]> {
        (0..n * n).map(move |i| [(i % n) as f64 + 0.5, (i / n) as f64 + 0.5].map(|x| x / n as f64))
    }

    fn view(cos: f64) -> DVec3 {
        DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
    }

    /// The mean of f over visible normals equals the integral of f · D G1 max(0, v·h)/(n·v) over the hemisphere.
    #[test]
    fn samples_have_the_distribution_of_visible_normals() {
        for (alpha, cos) in [(0.1, 0.9), (0.3, 0.4), (0.8, 0.2), (1.0, 1.0)] {
            let v = view(cos);
            let f = |h: DVec3| h.x + 2.0 * h.z * h.z + h.y * h.y;
            let sampled: f64 =
                grid(200).map(|u| f(sample_visible_normal(v, alpha, u))).sum::<f64>() / 40_000.0;
            let mut sum = 0.0;
            let mut total = 0.0;
            for [a, b] in grid(1500) {
                // Denser around the normal, where D is.
                let theta = 0.5 * PI * b * b;
                let phi = TAU * a;
                let h = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                let g1 = 1.0 / (1.0 + smith_lambda(v.z, alpha));
                let density = distribution(h.z, alpha) * g1 * v.dot(h).max(0.0) / v.z;
                let area = theta.sin() * (0.5 * PI * 2.0 * b) * TAU / (1500.0 * 1500.0);
                sum += f(h) * density * area;
                total += density * area;
            }
            assert!((total - 1.0).abs() < 2e-3, "{alpha} {cos}: {total}");
            assert!((sampled - sum).abs() < 4e-3, "{alpha} {cos}: {sampled} {sum}");
        }
    }

    #[test]
    fn reflected_densities_are_those_of_the_samples() {
        // ∫ pdf over the directions above and below the horizon is 1: E[1/pdf] over samples is the covered solid angle.
        let (alpha, v) = (0.5, view(0.7));
        let mut inside = 0.0;
        let mut expected = 0.0;
        let cap = 0.9f64;
        for u in grid(300) {
            let h = sample_visible_normal(v, alpha, u);
            let l = h * (2.0 * v.dot(h)) - v;
            if l.z > cap {
                inside += 1.0 / reflected_pdf(v.z, h.z, alpha) / 90_000.0;
            }
            expected = TAU * (1.0 - cap);
        }
        assert!((inside / expected - 1.0).abs() < 0.02, "{inside} {expected}");
    }

    #[test]
    fn mirrors_and_grazing_views_give_finite_normals() {
        for alpha in [0.0, 1e-4, 1.0] {
            for cos in [1e-6, 0.5, 1.0] {
                for u in [[0.0, 0.0], [0.5, 1.0 - 1e-9], [0.25, 0.5]] {
                    let h = sample_visible_normal(view(cos), alpha, u);
                    assert!((h.length() - 1.0).abs() < 1e-9 && h.z >= 0.0, "{alpha} {cos} {u:?}: {h}");
                }
            }
        }
    }
}
