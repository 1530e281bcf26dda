//! GGX lobes at a surface: their samples, and the light of an environment that they reflect.
//!
//! The light of an environment is averaged by filtered importance sampling (Křivánek and Colbert, “Real-time Shading with
//! Filtered Importance Sampling”, EGSR 2008): a fixed set of directions drawn from the lobe, each looked up with the solid
//! angle that it stands for. Neighbouring pixels use the same set, so there is no noise.

use std::f64::consts::PI;
use std::sync::OnceLock;

use glam::DVec3;

use crate::geometry::{Rgb, golden_angle};
use crate::integrator::material::directional_albedo::single_scattering_albedo;
use crate::integrator::material::fresnel::schlick_weight;
use crate::integrator::material::ggx::{
    MIRROR_ALPHA, reflected_pdf, sample_visible_normal, sample_visible_normal_at, shadowing_ratio,
};
use crate::integrator::material::lobe_moments::LobeMoments;
use crate::scene::Environment;

/// Directions in the set of a pixel, shared among its samples.
const LOBE_DIRECTIONS: u32 = 32;
/// Solid angle of a lookup over that which its direction stands for. Lookups are filtered a little wider than requested,
/// between texels and between levels; 0.7 comes closest to the integral over the lobe.
const FILTER_WIDTH: f64 = 0.7;

/// A lobe at a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lobe {
    /// Shading normal, unit length.
    pub n: DVec3,
    /// Unit direction to the viewer.
    pub v: DVec3,
    /// GGX α, widened by the normals that the sample covers.
    pub alpha: f64,
    /// Mean reflectance at normal incidence, which weights the directions.
    pub f0: f64,
}

/// A direction that a lobe reflects.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LobeSample {
    /// Unit direction.
    pub l: DVec3,
    /// The mean over all samples of the weight times the radiance is the radiance averaged over the lobe. 0 below the horizon.
    pub weight: f32,
    /// Solid angle in steradians that the sample stands for.
    pub solid_angle: f32,
}

/// The directions of one sample among those of its pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LobeSubset {
    /// Index of the sample.
    pub index: u32,
    /// Number of samples of a pixel.
    pub count: u32,
}

impl Lobe {
    /// Returns the radiance of the environment, averaged over the lobe: 1 under a white one. Directions below the horizon
    /// count as black, as they do in the lobe's albedo.
    pub fn environment_radiance(&self, environment: &Environment, subset: LobeSubset) -> Rgb {
        if let Some(radiance) = environment.as_uniform() {
            return radiance;
        }
        let Lobe { n, v, alpha, f0 } = *self;
        let basis = LobeBasis::new(n, v);
        if alpha < MIRROR_ALPHA {
            let l = basis.to_world(DVec3::new(-basis.v.x, -basis.v.y, basis.v.z));
            // About the half-width of the lobe, which is twice that of the normals.
            return environment.radiance(l.as_vec3(), (4.0 * PI * alpha * alpha) as f32);
        }
        let count = subset.count.max(1);
        let per_sample = LOBE_DIRECTIONS.div_ceil(count).max(1);
        let total = per_sample.saturating_mul(count);
        let first = (subset.index % count) * per_sample;
        let mut sum = Rgb::ZERO;
        for i in first..first + per_sample {
            let u = (f64::from(i) + 0.5) / f64::from(total);
            let m = sample_visible_normal_at(basis.v, alpha, direction_around(i), u);
            let v_m = basis.v.dot(m);
            let l = m * (2.0 * v_m) - basis.v;
            let weight = shadowing_ratio(basis.v.z, l.z, alpha) * (f0 + (1.0 - f0) * schlick_weight(v_m));
            if weight > 0.0 {
                let solid_angle = FILTER_WIDTH / (f64::from(total) * reflected_pdf(basis.v.z, m.z, alpha));
                let radiance =
                    environment.radiance(basis.to_world(l).as_vec3(), solid_angle.min(2.0 * PI) as f32);
                sum += radiance * weight as f32;
            }
        }
        let expected = single_scattering_albedo(basis.v.z as f32, alpha as f32, f0 as f32);
        sum / (per_sample as f32 * expected)
    }

    /// The same by one lookup, without the stretch of lobes at grazing angles: for weak lobes.
    pub fn prefiltered_radiance(&self, environment: &Environment) -> Rgb {
        if let Some(radiance) = environment.as_uniform() {
            return radiance;
        }
        let (n, v) = (self.n.as_vec3(), self.v.as_vec3());
        let cos = n.dot(v);
        let LobeMoments { x, z, alpha } = LobeMoments::new(cos, self.alpha as f32);
        let away = (n * cos - v).normalize_or_zero();
        environment.prefiltered((away * x + n * z).normalize_or(n), alpha)
    }
}

impl Lobe {
    /// Returns a direction that the lobe reflects, for a point of the unit square: one of `count` samples.
    pub fn sample(&self, u: [f64; 2], count: u32) -> LobeSample {
        let Lobe { n, v, alpha, f0 } = *self;
        let basis = LobeBasis::new(n, v);
        if alpha < MIRROR_ALPHA {
            let l = basis.to_world(DVec3::new(-basis.v.x, -basis.v.y, basis.v.z));
            return LobeSample { l, weight: 1.0, solid_angle: (4.0 * PI * alpha * alpha) as f32 };
        }
        let m = sample_visible_normal(basis.v, alpha, u);
        let v_m = basis.v.dot(m);
        let l = m * (2.0 * v_m) - basis.v;
        let weight = shadowing_ratio(basis.v.z, l.z, alpha) * (f0 + (1.0 - f0) * schlick_weight(v_m));
        let expected = single_scattering_albedo(basis.v.z as f32, alpha as f32, f0 as f32);
        let solid_angle = FILTER_WIDTH / (f64::from(count.max(1)) * reflected_pdf(basis.v.z, m.z, alpha));
        LobeSample {
            l: basis.to_world(l),
            weight: weight as f32 / expected,
            solid_angle: solid_angle.min(2.0 * PI) as f32,
        }
    }

    /// Returns a microfacet normal that is visible to the viewer, for a point of the unit square.
    pub fn sample_normal(&self, u: [f64; 2]) -> DVec3 {
        let basis = LobeBasis::new(self.n, self.v);
        basis.to_world(sample_visible_normal(basis.v, self.alpha, u))
    }
}

/// The basis of a surface: z is the normal, and the viewer is in the xz plane.
struct LobeBasis {
    x: DVec3,
    y: DVec3,
    z: DVec3,
    /// Direction to the viewer, at least a little above the surface.
    v: DVec3,
}

impl LobeBasis {
    fn new(n: DVec3, v: DVec3) -> LobeBasis {
        // A shading normal may face away from the viewer.
        let cos = n.dot(v).clamp(MIN_COS, 1.0);
        let tangent = v - n * n.dot(v);
        let x = tangent.try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
        LobeBasis { x, y: n.cross(x), z: n, v: DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos) }
    }

    fn to_world(&self, d: DVec3) -> DVec3 {
        self.x * d.x + self.y * d.y + self.z * d.z
    }
}

/// Smallest cosine between normal and viewer.
const MIN_COS: f64 = 1e-3;

/// Cosine and sine of the angle of direction number `i`: steps of the golden angle, which together with equal steps of the
/// radius spread directions evenly.
fn direction_around(i: u32) -> [f64; 2] {
    let compute = |i: u32| golden_angle(i, 0.13);
    static DIRECTIONS: OnceLock<[[f64; 2]; TABULATED_ANGLES]> = OnceLock::new();
    let table = DIRECTIONS.get_or_init(|| std::array::from_fn(|i| compute(i as u32)));
    table.get(i as usize).copied().unwrap_or_else(|| compute(i))
}

/// Angles that are computed once.
const TABULATED_ANGLES: usize = 256;

#[cfg(test)]
mod tests;
