//! GGX lobes at a surface.

use std::f64::consts::PI;

use glam::DVec3;

use crate::integrator::material::facet_view::FacetView;
use crate::integrator::material::ggx::{MIRROR_ALPHA, sample_visible_normal};
use crate::integrator::surface::soa::{dvec3, set3};
use blinn_core::geometry::Rgb;
use blinn_scene::Environment;

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

/// Lobes that are computed together.
pub(crate) const LOBE_LANES: usize = 16;

/// A [`Lobe`] in each lane. Lanes behind the last lobe may hold any value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lobe16 {
    n: [[f64; LOBE_LANES]; 3],
    v: [[f64; LOBE_LANES]; 3],
    alpha: [f64; LOBE_LANES],
    f0: [f64; LOBE_LANES],
}

impl Lobe16 {
    pub const ZERO: Lobe16 = Lobe16 {
        n: [[0.0; LOBE_LANES]; 3],
        v: [[0.0; LOBE_LANES]; 3],
        alpha: [0.0; LOBE_LANES],
        f0: [0.0; LOBE_LANES],
    };

    #[inline(always)]
    pub fn set(&mut self, i: usize, lobe: &Lobe) {
        set3(&mut self.n, i, lobe.n.to_array());
        set3(&mut self.v, i, lobe.v.to_array());
        self.alpha[i] = lobe.alpha;
        self.f0[i] = lobe.f0;
    }

    #[inline(always)]
    pub fn get(&self, i: usize) -> Lobe {
        Lobe { n: dvec3(&self.n, i), v: dvec3(&self.v, i), alpha: self.alpha[i], f0: self.f0[i] }
    }

    /// The microfacets of lobe `i`, seen from its viewer.
    #[inline(always)]
    pub fn facet_view(&self, i: usize) -> FacetView {
        let Lobe { n, v, alpha, .. } = self.get(i);
        FacetView::new(n.as_vec3(), v.as_vec3(), alpha as f32)
    }

    /// α of all lobes.
    #[inline(always)]
    pub fn alpha(&self) -> [f32; LOBE_LANES] {
        self.alpha.map(|alpha| alpha as f32)
    }

    /// The mean reflectance of all lobes at normal incidence.
    #[inline(always)]
    pub fn f0(&self) -> [f32; LOBE_LANES] {
        self.f0.map(|f0| f0 as f32)
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
pub(crate) const MIN_COS: f64 = 1e-3;
