//! Directional albedo of rough glass whose facets reflect or refract light once: the share of the light from a direction that
//! leaves on the right side. Other facets block the rest, which in truth scatters on and leaves later. Rays of rough glass are
//! weighted by the inverse, as in Cycles (Turquin, “Practical multiple scattering compensation for microfacet models”, 2019).

mod table;

use self::table::{ALBEDO, COLUMNS, INDICES, ROWS};

/// The albedo at cosine `cos` to the viewer, for a GGX `alpha` and an index of refraction `eta` behind the surface over that in
/// front of it.
pub(crate) fn glass_albedo(cos: f64, alpha: f64, eta: f64) -> f64 {
    let r = reflectance(eta as f32);
    let above = INDICES[1..INDICES.len() - 1].iter().position(|&index| reflectance(index) > r);
    let i = above.unwrap_or(INDICES.len() - 2);
    let [from, to] = [INDICES[i], INDICES[i + 1]].map(reflectance);
    let (row, y) = node(alpha as f32, ROWS);
    let (column, x) = node(cos as f32, COLUMNS);
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let [a, b] = [i, i + 1].map(|i| {
        let [upper, lower] = [row, row + 1].map(|row| {
            let [a, b] = [column, column + 1].map(|column| f32::from(ALBEDO[i][row][column]));
            mix(a, b, x)
        });
        mix(upper, lower, y)
    });
    f64::from(mix(a, b, ((r - from) / (to - from)).clamp(0.0, 1.0)) / 65535.0)
}

/// The amplitude that a boundary reflects at normal incidence, in which the nodes are interpolated.
fn reflectance(index: f32) -> f32 {
    (index - 1.0) / (index + 1.0)
}

/// The node before `x` of `count` nodes at the squares of k/(count − 1), and the way from it to the next.
fn node(x: f32, count: usize) -> (usize, f32) {
    let x = x.clamp(0.0, 1.0).sqrt() * (count - 1) as f32;
    // NaN becomes index 0.
    let i = (x as usize).min(count - 2);
    (i, x - i as f32)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::integrator::material::fresnel::fresnel_dielectric;
    use crate::integrator::material::ggx::{sample_visible_normal, shadowing_ratio};

    /// The albedo as a mean over facets.
    fn mean_over_facets(cos: f64, alpha: f64, eta: f64) -> f64 {
        let v = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let n = 200;
        let mut sum = 0.0;
        for i in 0..n * n {
            let u = [i % n, i / n].map(|k| (f64::from(k) + 0.5) / f64::from(n));
            let m = sample_visible_normal(v, alpha, u);
            let v_m = v.dot(m);
            let reflected = m.z * 2.0 * v_m - v.z;
            let cos_t = (1.0 - (1.0 - v_m * v_m) / (eta * eta)).max(0.0).sqrt();
            let refracted = m.z * (v_m / eta - cos_t) - v.z / eta;
            let share = fresnel_dielectric(v_m, eta);
            sum += share * shadowing_ratio(v.z, reflected, alpha)
                + (1.0 - share) * shadowing_ratio(v.z, -refracted, alpha);
        }
        sum / f64::from(n * n)
    }

    #[test]
    fn the_albedo_is_the_mean_over_facets() {
        for eta in [0.4, 0.6, 0.667, 0.8, 1.2, 1.33, 1.45, 1.6, 2.4] {
            for alpha in [0.02, 0.1, 0.3, 0.8] {
                for cos in [0.1, 0.4, 0.9] {
                    let expected = mean_over_facets(cos, alpha, eta);
                    let albedo = glass_albedo(cos, alpha, eta);
                    assert!(
                        (albedo / expected - 1.0).abs() < 0.02,
                        "{eta} {alpha} {cos}: {albedo} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn values_outside_of_the_table_take_its_nearest() {
        assert_eq!(glass_albedo(2.0, 5.0, 9.0), glass_albedo(1.0, 1.0, 3.0));
        assert_eq!(glass_albedo(-1.0, -1.0, 0.01), glass_albedo(0.0, 0.0, 1.0 / 3.0));
        assert!(glass_albedo(f64::NAN, f64::NAN, f64::NAN).is_nan());
    }
}
