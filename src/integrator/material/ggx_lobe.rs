//! GGX lobes at a surface.

use std::f64::consts::PI;

use glam::DVec3;

use crate::geometry::Rgb;
use crate::integrator::material::ggx::{MIRROR_ALPHA, sample_visible_normal};
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

impl Lobe {
    /// True if the lobe is as narrow as that of a mirror.
    #[inline(always)]
    pub fn is_mirror(&self) -> bool {
        self.alpha < MIRROR_ALPHA
    }

    /// Returns the radiance of the environment from the mirror's direction, averaged over about the half-width of the lobe,
    /// which is twice that of the normals.
    pub fn mirrored_radiance(&self, environment: &Environment) -> Rgb {
        let basis = LobeBasis::new(self.n, self.v);
        environment.radiance(basis.to_world(basis.mirrored()).as_vec3(), self.mirror_solid_angle() as f32)
    }

    /// Solid angle in steradians of the lobe of a mirror.
    #[inline(always)]
    pub fn mirror_solid_angle(&self) -> f64 {
        4.0 * PI * self.alpha * self.alpha
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
    #[inline(always)]
    pub fn new(n: DVec3, v: DVec3) -> LobeBasis {
        // A shading normal may face away from the viewer.
        let cos = n.dot(v).clamp(MIN_COS, 1.0);
        let tangent = v - n * n.dot(v);
        let x = tangent.try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
        LobeBasis { x, y: n.cross(x), z: n, v: DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos) }
    }

    /// The mirror's direction.
    #[inline(always)]
    pub fn mirrored(&self) -> DVec3 {
        DVec3::new(-self.v.x, -self.v.y, self.v.z)
    }

    /// The direction in the world of a direction in the basis.
    #[inline(always)]
    pub fn to_world(&self, d: DVec3) -> DVec3 {
        self.x * d.x + self.y * d.y + self.z * d.z
    }
}

/// Smallest cosine between normal and viewer.
const MIN_COS: f64 = 1e-3;
