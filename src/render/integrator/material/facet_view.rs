//! GGX microfacets seen from a direction, in f32: what all samples of a lobe share is computed once. For loops over many lobes;
//! [`ggx`](super::ggx) has the same functions in f64.

use std::f32::consts::PI;

use glam::Vec3;

use crate::integrator::material::ggx::MIRROR_ALPHA;

/// Smallest cosine between normal and viewer.
const MIN_COS: f32 = 1e-3;

/// Solid angle of a lookup over that which its direction stands for. Lookups are filtered a little wider than requested,
/// between texels and between levels; 0.7 comes closest to the integral over the lobe.
const FILTER_WIDTH: f32 = 0.7;

/// Microfacets of a roughness seen from a direction. Local directions are in the frame of the surface: z is the shading normal,
/// and the viewer is in the xz plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacetView {
    /// The axes of the local frame.
    x: Vec3,
    y: Vec3,
    z: Vec3,
    /// Local direction to the viewer, at least a little above the surface.
    v: Vec3,
    /// GGX α, at least that of the widest mirror.
    alpha: f32,
    /// `v`, stretched as the distribution is to that of a roughness of 1.
    stretched: Vec3,
    /// 1 + Λ of Smith's shadowing for `v`.
    one_plus_lambda: f32,
}

/// A direction that microfacets reflect.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacetSample {
    /// Unit direction in the world.
    pub l: Vec3,
    /// The mean over all samples is the share of light that the facets reflect once, with Schlick's Fresnel term. 0 below the
    /// horizon.
    pub weight: f32,
    /// Density of the direction per solid angle.
    pub pdf: f32,
}

impl FacetSample {
    /// Solid angle in steradians to filter over where the lobe has `count` samples.
    #[inline(always)]
    pub fn solid_angle(&self, count: f32) -> f32 {
        (FILTER_WIDTH / (count * self.pdf)).min(2.0 * PI)
    }
}

impl FacetView {
    /// Number of members of [`FacetView::to_array`].
    pub const LEN: usize = 15;

    /// Facets of roughness `alpha` around the shading normal `n`, seen from the unit direction `v`.
    #[inline(always)]
    pub fn new(n: Vec3, v: Vec3, alpha: f32) -> FacetView {
        let cos = n.dot(v);
        let tangent = v - n * cos;
        let sin = tangent.length();
        let is_perpendicular = !(sin > 1e-6);
        let x = if is_perpendicular { n.any_orthonormal_vector() } else { tangent * (1.0 / sin) };
        // A shading normal may face away from the viewer.
        let is_above = cos > MIN_COS;
        let v = if is_above { Vec3::new(sin, 0.0, cos) } else { Vec3::new(1.0, 0.0, MIN_COS) };
        let alpha = alpha.max(MIRROR_ALPHA as f32);
        let stretched = Vec3::new(v.x * alpha, 0.0, v.z);
        FacetView {
            x,
            y: n.cross(x),
            z: n,
            v,
            alpha,
            stretched: stretched * (1.0 / stretched.length()),
            one_plus_lambda: one_plus_lambda(v.z, alpha),
        }
    }

    /// Cosine of the angle between the normal and the viewer.
    #[inline(always)]
    pub fn cos(&self) -> f32 {
        self.v.z
    }

    /// Samples a direction by the visible normals: see [`sample_visible_normal_at`](super::ggx::sample_visible_normal_at).
    /// `f0` is the reflectance at normal incidence.
    #[inline(always)]
    pub fn sample(&self, [cos, sin]: [f32; 2], u: f32, f0: f32) -> FacetSample {
        let FacetView { v, alpha, stretched: w, one_plus_lambda: lambda_v, .. } = *self;
        let z = (1.0 - u) * (1.0 + w.z) - w.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let m = Vec3::new(r * cos + w.x, r * sin, (z + w.z).max(0.0));
        let m = Vec3::new(m.x * alpha, m.y * alpha, m.z);
        let length = m.length();
        let m = if length > 0.0 { m * (1.0 / length) } else { Vec3::Z };
        let v_m = v.x * m.x + v.z * m.z;
        let l = m * (2.0 * v_m) - v;
        let fade = (1.0 - v_m).clamp(0.0, 1.0);
        let fade2 = fade * fade;
        let reflectance = f0 + (1.0 - f0) * (fade2 * fade2 * fade);
        let shadowing = lambda_v / (lambda_v + (one_plus_lambda(l.z, alpha) - 1.0));
        let weight = if l.z > 0.0 { shadowing * reflectance } else { 0.0 };
        // D(m). The sine has digits near the normal that 1 − cos² has lost.
        let a2 = alpha * alpha;
        let d = (m.x * m.x + m.y * m.y) + a2 * (m.z * m.z);
        let pdf = a2 / (4.0 * PI * (d * d) * (lambda_v * v.z));
        FacetSample { l: self.x * l.x + self.y * l.y + self.z * l.z, weight, pdf }
    }

    /// All numbers, for storage as arrays.
    #[inline(always)]
    pub fn to_array(self) -> [f32; FacetView::LEN] {
        let FacetView { x, y, z, v, alpha, stretched: w, one_plus_lambda } = self;
        [x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z, v.x, v.z, alpha, w.x, w.z, one_plus_lambda]
    }

    /// The inverse of [`FacetView::to_array`].
    #[inline(always)]
    pub fn from_array(a: [f32; FacetView::LEN]) -> FacetView {
        FacetView {
            x: Vec3::new(a[0], a[1], a[2]),
            y: Vec3::new(a[3], a[4], a[5]),
            z: Vec3::new(a[6], a[7], a[8]),
            v: Vec3::new(a[9], 0.0, a[10]),
            alpha: a[11],
            stretched: Vec3::new(a[12], 0.0, a[13]),
            one_plus_lambda: a[14],
        }
    }
}

/// 1 + Λ of Smith's shadowing for a direction at cosine `cos` to the normal.
#[inline(always)]
fn one_plus_lambda(cos: f32, alpha: f32) -> f32 {
    let cos2 = cos * cos;
    let tan2 = (1.0 - cos2).max(0.0) / cos2;
    0.5 + 0.5 * (1.0 + alpha * alpha * tan2).sqrt()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::integrator::material::fresnel::schlick_weight;
    use crate::integrator::material::ggx::{reflected_pdf, sample_visible_normal_at, shadowing_ratio};
    use crate::integrator::material::ggx_lobe::LobeBasis;
    use blinn_core::geometry::cos_sin_of_turns;

    #[test]
    fn samples_are_those_of_f64() {
        let n = DVec3::new(0.36, 0.48, 0.8);
        let mut compared = 0;
        for (alpha, f0) in [(0.004f32, 0.04f32), (0.05, 0.9), (0.3, 0.04), (1.0, 0.5)] {
            for v in [n, DVec3::Z, DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.8, 0.0, -0.3).normalize()] {
                let view = FacetView::new(n.as_vec3(), v.as_vec3(), alpha);
                let view = FacetView::from_array(view.to_array());
                let basis = LobeBasis::new(n, v);
                for i in 0..64 {
                    let (turns, u) = (f64::from(i) * 0.618 % 1.0, (f64::from(i) + 0.5) / 64.0);
                    let around = cos_sin_of_turns(turns);
                    let a = f64::from(alpha);
                    let m = sample_visible_normal_at(basis.v, [a; 2], around, u);
                    let v_m = basis.v.dot(m);
                    let l = m * (2.0 * v_m) - basis.v;
                    let f0_64 = f64::from(f0);
                    let weight =
                        shadowing_ratio(basis.v.z, l.z, a) * (f0_64 + (1.0 - f0_64) * schlick_weight(v_m));
                    let sample = view.sample(around.map(|x| x as f32), u as f32, f0);
                    // A viewer along the normal sees no azimuth.
                    if v != n {
                        let error = sample.l.as_dvec3().distance(basis.to_world(l));
                        assert!(error < 2e-4 * (a + 0.02), "{alpha} {v} {i}: {error}");
                        compared += 1;
                    }
                    if l.z.abs() > 1e-3 {
                        let error = (f64::from(sample.weight) - weight).abs();
                        assert!(error < 1e-3, "{alpha} {v} {i}: {error}");
                    }
                    let pdf = f64::from(sample.pdf) / reflected_pdf(basis.v.z, m.z, a);
                    assert!((pdf - 1.0).abs() < 0.02, "{alpha} {v} {i}: {pdf}");
                }
            }
        }
        assert!(compared > 500);
    }
}
