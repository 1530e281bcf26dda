//! Directional albedo of rough glass whose facets reflect or refract light once: the share of the light from a direction that
//! leaves on the right side. Other facets block the rest, which in truth scatters on and leaves later. Rays of rough glass are
//! scaled up instead, as in Cycles (Turquin, “Practical multiple scattering compensation for microfacet models”, 2019), with the
//! tint of further facets (Kulla and Conty, “Revisiting Physically Based Shading at Imageworks”, 2017).

mod table;

use self::table::{ALBEDO, COLUMNS, INDICES, MEAN, ROWS};
use crate::integrator::material::ggx::shadowing_ratio;
use crate::integrator::material::table_place::table_place;
use blinn_core::geometry::Rgb;

/// The albedo of rough glass seen from a direction.
#[derive(Clone, Copy, Debug)]
struct GlassAlbedo {
    /// The share of light that leaves on the right side.
    albedo: f32,
    /// Its mean over the directions of viewers, weighted by their cosine.
    mean: f32,
}

impl GlassAlbedo {
    /// The albedo at cosine `cos` to the viewer, for a GGX `alpha` and an index of refraction `eta` behind the surface over that in
    /// front of it.
    fn new(cos: f64, alpha: f64, eta: f64) -> GlassAlbedo {
        let r = reflectance(eta as f32);
        let above = INDICES[1..INDICES.len() - 1].iter().position(|&index| reflectance(index) > r);
        let i = above.unwrap_or(INDICES.len() - 2);
        let [from, to] = [INDICES[i], INDICES[i + 1]].map(reflectance);
        let z = ((r - from) / (to - from)).clamp(0.0, 1.0);
        let (row, y) = table_place((alpha as f32).max(0.0).sqrt(), ROWS);
        let (column, x) = table_place((cos as f32).max(0.0).sqrt(), COLUMNS);
        let mix = |[a, b]: [f32; 2], t: f32| a + (b - a) * t;
        let in_row = |i: usize, row: usize| {
            mix([column, column + 1].map(|column| f32::from(ALBEDO[i][row][column])), x)
        };
        let in_table = |i: usize| mix([row, row + 1].map(|row| in_row(i, row)), y);
        let mean_in_table = |i: usize| mix([row, row + 1].map(|row| f32::from(MEAN[i][row])), y);
        GlassAlbedo {
            albedo: mix([i, i + 1].map(in_table), z) / 65535.0,
            mean: mix([i, i + 1].map(mean_in_table), z) / 65535.0,
        }
    }

    /// The factor of light that facets of a `tint` scatter once, for all that they scatter: at least 1.
    fn compensation(&self, tint: Rgb) -> Rgb {
        let GlassAlbedo { albedo, mean } = *self;
        let tint = tint.clamp(Rgb::ZERO, Rgb::ONE);
        let further = tint * mean / (Rgb::ONE - tint * (1.0 - mean));
        Rgb::ONE + further * ((1.0 - albedo) / albedo)
    }
}

/// Facets of rough glass that block the light of others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockingFacets {
    /// Cosine between the normal and the viewer, above 0.
    pub cos: f64,
    /// GGX α.
    pub alpha: f64,
    /// Tint of a surface.
    pub tint: Rgb,
}

impl BlockingFacets {
    /// The factor of all rays for the light that is blocked, by the index of refraction `eta` behind the surface over that in
    /// front of it.
    pub fn compensation(&self, eta: f64) -> Rgb {
        GlassAlbedo::new(self.cos, self.alpha, eta).compensation(self.tint)
    }

    /// The share of a ray that leaves between other facets, at cosine `cos_out` to the normal on its own side.
    pub fn visible_share(&self, cos_out: f64) -> f32 {
        shadowing_ratio(self.cos, cos_out, self.alpha) as f32
    }
}

/// The amplitude that a boundary reflects at normal incidence, in which the nodes are interpolated.
fn reflectance(index: f32) -> f32 {
    (index - 1.0) / (index + 1.0)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::integrator::material::fresnel::fresnel_dielectric;
    use crate::integrator::material::ggx::sample_visible_normal;

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
                    let all = GlassAlbedo::new(cos, alpha, eta).compensation(Rgb::ONE) * expected as f32;
                    assert!((all - Rgb::ONE).abs().max_element() < 0.02, "{eta} {alpha} {cos}: {all}");
                }
            }
        }
    }

    /// Light scatters on from the directions in which it was blocked: the mean is that of the albedo.
    #[test]
    fn the_mean_is_that_of_all_viewers() {
        for (alpha, eta) in [(0.1, 1.5), (0.5, 1.33), (0.5, 0.7)] {
            let n = 1000;
            let cosines = (0..n).map(|i| (f64::from(i) + 0.5) / f64::from(n));
            let albedos = cosines.map(|cos| 2.0 * cos as f32 * GlassAlbedo::new(cos, alpha, eta).albedo);
            let expected = albedos.sum::<f32>() / n as f32;
            let mean = GlassAlbedo::new(0.5, alpha, eta).mean;
            assert!((mean - expected).abs() < 0.01, "{alpha} {eta}: {mean} {expected}");
        }
    }

    #[test]
    fn dark_glass_absorbs_what_it_scatters_on() {
        let glass = GlassAlbedo::new(0.5, 1.0, 1.5);
        let [black, grey, white] =
            [0.0, 0.5, 1.0].map(|tint| glass.compensation(Rgb::splat(tint)).max_element());
        assert_eq!(black, 1.0);
        assert!(grey > 1.05 && grey < white && (white - 1.0 / glass.albedo).abs() < 1e-5, "{grey} {white}");
    }

    #[test]
    fn values_outside_of_the_table_take_its_nearest() {
        let albedo = |cos, alpha, eta| GlassAlbedo::new(cos, alpha, eta).albedo;
        assert_eq!(albedo(2.0, 5.0, 9.0), albedo(1.0, 1.0, 3.0));
        assert_eq!(albedo(-1.0, -1.0, 0.01), albedo(0.0, 0.0, 1.0 / 3.0));
    }
}
