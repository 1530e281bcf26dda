//! Fresnel reflectance: exact for dielectrics, Schlick's approximation for metals.

/// Returns the share of unpolarised light that the boundary of a dielectric reflects. `cos` is the cosine of incidence,
/// `eta` the index of refraction on the other side over that on the side of the ray. 1 beyond the critical angle.
#[inline(always)]
pub(crate) fn fresnel_dielectric(cos: f64, eta: f64) -> f64 {
    let cos = cos.clamp(0.0, 1.0);
    // g = η cos θ_t; (g − c)/(g + c) is the amplitude of perpendicular polarisation (Cook and Torrance 1982).
    let g2 = eta * eta - 1.0 + cos * cos;
    if g2 <= 0.0 {
        return 1.0;
    }
    let g = g2.sqrt();
    let perpendicular = (g - cos) / (g + cos);
    let parallel = (cos * (g + cos) - 1.0) / (cos * (g - cos) + 1.0);
    0.5 * perpendicular * perpendicular * (1.0 + parallel * parallel)
}

/// Returns the exact reflectance of a dielectric of index `ior` ≥ 1, scaled to go from 0 at normal incidence to 1 at grazing
/// incidence: in place of Schlick's weight in F = F0 + (F90 − F0) · weight. In f32, for loops over many points.
#[inline(always)]
pub(crate) fn dielectric_weight(cos: f32, ior: f32) -> f32 {
    let cos = cos.clamp(0.0, 1.0);
    let g = (ior * ior - 1.0 + cos * cos).max(0.0).sqrt();
    let perpendicular = (g - cos) / (g + cos);
    let parallel = (cos * (g + cos) - 1.0) / (cos * (g - cos) + 1.0);
    let reflectance = 0.5 * perpendicular * perpendicular * (1.0 + parallel * parallel);
    let r = (ior - 1.0) / (ior + 1.0);
    let f0 = r * r;
    let weight = (reflectance - f0) / (1.0 - f0);
    // An index of 1 has NaN at grazing incidence, and reflects nothing.
    if weight > 0.0 { weight.min(1.0) } else { 0.0 }
}

/// Returns (1 − cos θ)⁵, the weight of Schlick's approximation F = F0 + (F90 − F0)(1 − cos θ)⁵.
#[inline(always)]
pub(crate) fn schlick_weight(cos: f64) -> f64 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    let m2 = m * m;
    m2 * m2 * m
}

/// Returns ((η − 1)/(η + 1))², the reflectance of a dielectric at normal incidence.
#[inline(always)]
pub(crate) fn f0_from_ior(eta: f64) -> f64 {
    let r = (eta - 1.0) / (eta + 1.0);
    r * r
}

/// Returns the index of refraction, at least 1, of a dielectric with reflectance `f0` at normal incidence; at most 99.
#[inline(always)]
pub(crate) fn ior_from_f0(f0: f64) -> f64 {
    let r = f0.clamp(0.0, 1.0).sqrt().min(0.98);
    (1.0 + r) / (1.0 - r)
}

/// Returns the index of refraction, at least 1, of a body that reflects `f0` at normal incidence, as KHR_materials_iridescence
/// takes it: also that of a metal.
#[inline]
pub(crate) fn ior_from_reflectance(f0: f64) -> f64 {
    let r = f0.clamp(0.0, 0.9999).sqrt();
    (1.0 + r) / (1.0 - r)
}

/// Returns the exact Fresnel curve of a dielectric, scaled to go from 0 at normal incidence to 1 at grazing incidence. In
/// F = F0 + (F90 − F0) · curve it takes the place of Schlick's weight, for an F0 that is tinted or weighted. The tables of
/// directional albedo are made from it.
#[cfg(test)]
pub(crate) fn dielectric_curve(cos: f64, eta: f64) -> f64 {
    let f0 = f0_from_ior(eta);
    if f0 >= 1.0 {
        return schlick_weight(cos);
    }
    ((fresnel_dielectric(cos, eta) - f0) / (1.0 - f0)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_reflects_four_percent_at_normal_and_all_at_grazing_incidence() {
        assert!((fresnel_dielectric(1.0, 1.5) - 0.04).abs() < 1e-12);
        assert!((fresnel_dielectric(0.0, 1.5) - 1.0).abs() < 1e-12);
        assert_eq!(fresnel_dielectric(0.5, 1.0), 0.0);
    }

    /// At Brewster's angle, tan θ = η, the parallel part vanishes and the perpendicular one is ((η² − 1)/(η² + 1))².
    #[test]
    fn the_parallel_part_vanishes_at_brewsters_angle() {
        for eta in [1.2, 1.5, 2.4] {
            let cos = 1.0 / f64::hypot(1.0, eta);
            let s = (eta * eta - 1.0) / (eta * eta + 1.0);
            assert!((fresnel_dielectric(cos, eta) - 0.5 * s * s).abs() < 1e-12, "{eta}");
        }
    }

    #[test]
    fn reflection_is_total_beyond_the_critical_angle() {
        let critical = (1.0 - 1.0 / (1.5f64 * 1.5)).sqrt();
        assert_eq!(fresnel_dielectric(critical - 1e-9, 1.0 / 1.5), 1.0);
        assert!(fresnel_dielectric(critical + 1e-3, 1.0 / 1.5) < 1.0);
    }

    /// Light takes the same way back: the reflectance is equal from both sides at the refracted angle.
    #[test]
    fn reflectance_is_the_same_from_both_sides() {
        for cos in [0.05, 0.3, 0.7, 0.95] {
            let inside = (1.0 - (1.0 - cos * cos) / (1.5f64 * 1.5)).sqrt();
            let [a, b] = [fresnel_dielectric(cos, 1.5), fresnel_dielectric(inside, 1.0 / 1.5)];
            assert!((a - b).abs() < 1e-12, "{cos}: {a} {b}");
        }
    }

    #[test]
    fn the_curve_of_a_dielectric_gives_back_its_reflectance() {
        for cos in [0.0, 0.1, 0.5, 1.0] {
            let f0 = f0_from_ior(1.7);
            let f = f0 + (1.0 - f0) * dielectric_curve(cos, 1.7);
            assert!((f - fresnel_dielectric(cos, 1.7)).abs() < 1e-12);
        }
        for cos in [0.0f32, 0.1, 0.5, 0.9, 1.0] {
            let exact = dielectric_curve(f64::from(cos), f64::from(1.7f32)) as f32;
            assert!((dielectric_weight(cos, 1.7) - exact).abs() < 1e-6, "{cos}");
        }
        assert!((ior_from_f0(f0_from_ior(1.7)) - 1.7).abs() < 1e-9);
        assert!(ior_from_f0(1.0).is_finite());
    }
}
