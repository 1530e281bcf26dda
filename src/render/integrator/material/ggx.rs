//! The GGX distribution of microfacets, with Smith's shadowing and visible normals.
//!
//! Directions are in the local frame of the surface: z is the normal. α is the square of the perceptual roughness.

#[cfg(test)]
use std::f64::consts::PI;

use glam::DVec3;

use blinn_core::geometry::cos_sin_of_turns;

/// Lobes of a smaller α are mirrors: they are as narrow as a texel of an environment.
pub(crate) const MIRROR_ALPHA: f64 = 0.004;
/// Glass of a smaller α is smooth: it refracts at the shading normal.
pub(crate) const SMOOTH_GLASS_ALPHA: f32 = 1e-3;
/// Lobes of at most this α are narrow: they show what they reflect.
pub(crate) const NARROW_ALPHA: f32 = 0.1;

/// Samples a microfacet normal visible from the unit direction `v`, v.z > 0, given a point `u` of the unit square (Dupuy
/// and Benyoub, “Sampling Visible GGX Normals with Spherical Caps”, 2023). The light that it reflects goes to
/// 2(v·m)m − v. The share of light that leaves the surface, for facets that reflect everything, is [`shadowing_ratio`].
#[inline(always)]
pub(crate) fn sample_visible_normal(v: DVec3, alpha: f64, u: [f64; 2]) -> DVec3 {
    sample_visible_normal_at(v, [alpha; 2], cos_sin_of_turns(u[0]), u[1])
}

/// [`sample_visible_normal`] with an α along each of the axes x and y, and the cosine and the sine of 2π u₀.
#[inline(always)]
pub(crate) fn sample_visible_normal_at(v: DVec3, alpha: [f64; 2], [cos, sin]: [f64; 2], u: f64) -> DVec3 {
    // The hemisphere of a roughness of 1, to which the distribution is stretched.
    let stretched = DVec3::new(v.x * alpha[0], v.y * alpha[1], v.z);
    let w = stretched * stretched.length_recip();
    let z = (1.0 - u) * (1.0 + w.z) - w.z;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let m = DVec3::new(r * cos, r * sin, z) + w;
    let m = DVec3::new(m.x * alpha[0], m.y * alpha[1], m.z.max(0.0));
    let length = m.length();
    if length > 0.0 { m / length } else { DVec3::Z }
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
    let lambda_v = smith_lambda(v_z, alpha);
    (1.0 + lambda_v) / (1.0 + lambda_v + smith_lambda(l_z, alpha))
}

/// Density of normals D(m).
#[cfg(test)]
fn distribution(m_z: f64, alpha: f64) -> f64 {
    let a2 = alpha * alpha;
    let c2 = m_z * m_z;
    // 1 − c² + α² c². The loss of digits near c = 1 does not matter: lobes of tiny α are mirrors.
    let d = (1.0 - c2) + a2 * c2;
    a2 / (PI * d * d)
}

/// Density per solid angle of the reflected direction of a visible normal `m`, seen from `v`: D G1 / (4 n·v). Renderings take
/// that of [`FacetView`](super::facet_view::FacetView).
#[cfg(test)]
pub(crate) fn reflected_pdf(v_z: f64, m_z: f64, alpha: f64) -> f64 {
    distribution(m_z, alpha) / ((1.0 + smith_lambda(v_z, alpha)) * 4.0 * v_z)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn grid(n: usize) -> impl Iterator<Item = [f64; 2]> {
        (0..n * n).map(move |i| [(i % n) as f64 + 0.5, (i / n) as f64 + 0.5].map(|x| x / n as f64))
    }

    fn view(cos: f64) -> DVec3 {
        DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
    }

    /// The mean of f over visible normals equals the integral of f · D G1 max(0, v·m)/(n·v) over the hemisphere.
    #[test]
    fn samples_have_the_distribution_of_visible_normals() {
        for (alpha, cos) in [(0.1, 0.9), (0.3, 0.4), (0.8, 0.2), (1.0, 1.0)] {
            let v = view(cos);
            let f = |m: DVec3| m.x + 2.0 * m.z * m.z + m.y * m.y;
            let sampled: f64 =
                grid(200).map(|u| f(sample_visible_normal(v, alpha, u))).sum::<f64>() / 40_000.0;
            let mut sum = 0.0;
            let mut total = 0.0;
            for [a, b] in grid(1500) {
                // Denser around the normal, where D is.
                let theta = 0.5 * PI * b * b;
                let phi = TAU * a;
                let m = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
                let g1 = 1.0 / (1.0 + smith_lambda(v.z, alpha));
                let density = distribution(m.z, alpha) * g1 * v.dot(m).max(0.0) / v.z;
                let area = theta.sin() * (0.5 * PI * 2.0 * b) * TAU / (1500.0 * 1500.0);
                sum += f(m) * density * area;
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
            let m = sample_visible_normal(v, alpha, u);
            let l = m * (2.0 * v.dot(m)) - v;
            if l.z > cap {
                inside += 1.0 / reflected_pdf(v.z, m.z, alpha) / 90_000.0;
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
                    let m = sample_visible_normal(view(cos), alpha, u);
                    assert!((m.length() - 1.0).abs() < 1e-9 && m.z >= 0.0, "{alpha} {cos} {u:?}: {m}");
                }
            }
        }
    }
}
