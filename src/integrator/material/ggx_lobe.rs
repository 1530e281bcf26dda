//! GGX lobes at a surface, and samples of them.

use std::f64::consts::PI;

use glam::DVec3;

use crate::geometry::Rgb;
use crate::integrator::material::directional_albedo::single_scattering_albedo;
use crate::integrator::material::fresnel::schlick_weight;
use crate::integrator::material::ggx::{MIRROR_ALPHA, reflected_pdf, sample_visible_normal, shadowing_ratio};
use crate::scene::Environment;

/// Solid angle of a lookup over that which its direction stands for. Lookups are filtered a little wider than requested,
/// between texels and between levels; 0.7 comes closest to the integral over the lobe.
pub(crate) const FILTER_WIDTH: f64 = 0.7;

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

impl Lobe {
    /// True if the lobe is as narrow as that of a mirror.
    pub fn is_mirror(&self) -> bool {
        self.alpha < MIRROR_ALPHA
    }

    /// Returns the radiance of the environment from the mirror's direction, averaged over about the half-width of the lobe,
    /// which is twice that of the normals.
    pub fn mirrored_radiance(&self, environment: &Environment) -> Rgb {
        let basis = LobeBasis::new(self.n, self.v);
        environment.radiance(basis.mirrored().as_vec3(), self.mirror_solid_angle())
    }

    fn mirror_solid_angle(&self) -> f32 {
        (4.0 * PI * self.alpha * self.alpha) as f32
    }

    /// Returns a direction that the lobe reflects, for a point of the unit square: one of `count` samples.
    #[inline]
    pub fn sample(&self, u: [f64; 2], count: u32) -> LobeSample {
        let Lobe { n, v, alpha, f0 } = *self;
        let basis = LobeBasis::new(n, v);
        if self.is_mirror() {
            return LobeSample { l: basis.mirrored(), weight: 1.0, solid_angle: self.mirror_solid_angle() };
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
pub(crate) struct LobeBasis {
    pub x: DVec3,
    pub y: DVec3,
    pub z: DVec3,
    /// Direction to the viewer in the basis, at least a little above the surface.
    pub v: DVec3,
}

impl LobeBasis {
    pub fn new(n: DVec3, v: DVec3) -> LobeBasis {
        // A shading normal may face away from the viewer.
        let cos = n.dot(v).clamp(MIN_COS, 1.0);
        let tangent = v - n * n.dot(v);
        let x = tangent.try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
        LobeBasis { x, y: n.cross(x), z: n, v: DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos) }
    }

    /// The mirror's direction in the world.
    fn mirrored(&self) -> DVec3 {
        self.to_world(DVec3::new(-self.v.x, -self.v.y, self.v.z))
    }

    fn to_world(&self, d: DVec3) -> DVec3 {
        self.x * d.x + self.y * d.y + self.z * d.z
    }
}

/// Smallest cosine between normal and viewer.
const MIN_COS: f64 = 1e-3;
