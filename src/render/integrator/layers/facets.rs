//! Anisotropic microfacets (KHR_materials_anisotropy): GGX with an α along each of two axes (Burley, “Physically Based Shading at
//! Disney”, 2012), in f64.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::integrator::material::directional_albedo::FacetAlbedo;
use crate::integrator::material::fresnel::{dielectric_weight, schlick_weight};
use crate::integrator::material::ggx::{MIRROR_ALPHA, sample_visible_normal_at};
use blinn_core::geometry::{Rgb, cos_sin_of_turns, golden_angle};
use blinn_scene::{AnisotropyModel, Environment};

/// Directions over which the environment is averaged.
const DIRECTIONS: u32 = 32;
/// Directions over which albedos are averaged: their error is less than a hundredth.
const ALBEDO_DIRECTIONS: u32 = 128;

/// Smallest cosine between normal and viewer.
const MIN_COS: f64 = 1e-3;

/// Solid angle of a lookup over that which its direction stands for: see [`FacetView`](crate::integrator::material::facet_view).
const FILTER_WIDTH: f64 = 0.7;

/// The stretch of microfacets at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anisotropy {
    /// The direction in which highlights are stretched.
    pub direction: DVec3,
    /// Strength, 0…1.
    pub strength: f32,
    /// How much the strength stretches.
    pub model: AnisotropyModel,
}

impl Anisotropy {
    /// α in the direction of the stretch and across it, for a material of α `alpha`.
    pub fn alphas(&self, alpha: f32) -> [f32; 2] {
        match self.model {
            AnisotropyModel::Gltf => [alpha + (1.0 - alpha) * self.strength * self.strength, alpha],
            AnisotropyModel::Principled => {
                let aspect = (1.0 - 0.9 * self.strength).sqrt();
                [(alpha / aspect).min(1.0), alpha * aspect]
            }
        }
    }
}

/// Microfacets seen from a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnisotropicFacets {
    /// The frame of the surface: the axes along which the two α hold, and the normal.
    axes: [DVec3; 3],
    /// Unit direction to the viewer in this frame, at least a little above the surface.
    v: DVec3,
    alpha: [f64; 2],
}

/// A direction that microfacets reflect.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FacetDirection {
    /// Unit direction in the world.
    pub l: DVec3,
    /// Cosine between the viewer and the facet.
    pub v_h: f64,
    /// G₂/G₁: the share of light that leaves the surface, for facets that reflect everything. 0 below the horizon.
    pub shadowing: f64,
    /// Density per steradian.
    pub density: f64,
}

impl FacetDirection {
    /// Solid angle in steradians to filter over where the lobe has `count` samples.
    pub fn solid_angle(&self, count: u32) -> f32 {
        (FILTER_WIDTH / (f64::from(count.max(1)) * self.density)).min(2.0 * PI) as f32
    }
}

impl AnisotropicFacets {
    /// Facets around the normal `n`, with α along the projection of `tangent` and across it, seen from the unit direction `v`.
    pub fn new(n: DVec3, tangent: DVec3, v: DVec3, alpha: [f32; 2]) -> AnisotropicFacets {
        let t = (tangent - n * n.dot(tangent)).try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
        let axes = [t, n.cross(t), n];
        let local = DVec3::from(axes.map(|axis| axis.dot(v)));
        let v = DVec3::new(local.x, local.y, local.z.max(MIN_COS)).normalize();
        AnisotropicFacets { axes, v, alpha: alpha.map(|alpha| f64::from(alpha).max(MIRROR_ALPHA)) }
    }

    /// The same facets with other α.
    pub fn with_alpha(self, alpha: [f32; 2]) -> AnisotropicFacets {
        AnisotropicFacets { alpha: alpha.map(f64::from), ..self }
    }

    /// The α of isotropic facets that are as rough.
    pub fn mean_alpha(&self) -> f32 {
        (self.alpha[0] * self.alpha[1]).sqrt() as f32
    }

    fn to_local(self, d: DVec3) -> DVec3 {
        DVec3::from(self.axes.map(|axis| axis.dot(d)))
    }

    fn to_world(self, d: DVec3) -> DVec3 {
        self.axes[0] * d.x + self.axes[1] * d.y + self.axes[2] * d.z
    }

    /// The density D of normals.
    fn distribution(&self, h: DVec3) -> f64 {
        let [x, y] = self.alpha;
        let q = (h.x / x).powi(2) + (h.y / y).powi(2) + h.z * h.z;
        1.0 / (PI * x * y * q * q)
    }

    /// Λ of Smith's shadowing for a direction above the surface.
    fn lambda(&self, w: DVec3) -> f64 {
        let [x, y] = self.alpha;
        let slope2 = ((x * w.x).powi(2) + (y * w.y).powi(2)) / (w.z * w.z);
        0.5 * ((1.0 + slope2).sqrt() - 1.0)
    }

    /// π D G₂ / (4 n·v) for light from direction `l`, and the cosine between the viewer and the facet, as
    /// [`highlight_lobe`](crate::integrator::material::highlight_lobe::highlight_lobe).
    pub fn highlight(&self, l: Vec3) -> [f32; 2] {
        let l = self.to_local(l.as_dvec3());
        let Some(h) = (self.v + l).try_normalize().filter(|_| l.z > 0.0) else { return [0.0; 2] };
        let g2 = 1.0 / (1.0 + self.lambda(self.v) + self.lambda(l));
        let lobe = PI * self.distribution(h) * g2 / (4.0 * self.v.z);
        [lobe as f32, self.v.dot(h) as f32]
    }

    /// Density per steradian with which a ray of the lobe is reflected to `l`.
    pub fn pdf(&self, l: Vec3) -> f32 {
        let Some(h) = (self.v + self.to_local(l.as_dvec3())).try_normalize() else { return 0.0 };
        self.density(h) as f32
    }

    /// Density per steradian of the direction that facets of normal `h` reflect.
    fn density(&self, h: DVec3) -> f64 {
        self.distribution(h) / ((1.0 + self.lambda(self.v)) * 4.0 * self.v.z)
    }

    /// A facet's normal in the world that is visible to the viewer, for a point of the unit square.
    pub fn sample_normal(&self, u: [f64; 2]) -> DVec3 {
        self.to_world(sample_visible_normal_at(self.v, self.alpha, cos_sin_of_turns(u[0]), u[1]))
    }

    /// A direction that the facets reflect, for a point of the unit square.
    pub fn sample(&self, u: [f32; 2]) -> FacetDirection {
        let [turn, u] = u.map(f64::from);
        self.sample_at(cos_sin_of_turns(turn), u)
    }

    fn sample_at(&self, around: [f64; 2], u: f64) -> FacetDirection {
        let h = sample_visible_normal_at(self.v, self.alpha, around, u);
        let v_h = self.v.dot(h);
        let l = h * (2.0 * v_h) - self.v;
        let one_plus_lambda = 1.0 + self.lambda(self.v);
        let shadowing = if l.z > 0.0 { one_plus_lambda / (one_plus_lambda + self.lambda(l)) } else { 0.0 };
        FacetDirection { l: self.to_world(l), v_h, shadowing, density: self.density(h) }
    }

    /// The direction of index `i` of a fixed set of `count` that spreads evenly over the lobe.
    fn direction(&self, i: u32, count: u32) -> FacetDirection {
        self.sample_at(golden_angle(i, 0.13), (f64::from(i) + 0.5) / f64::from(count))
    }

    /// The mean over the lobe of the share of light that leaves the surface, times a function of the cosine between viewer and
    /// facet.
    pub fn mean<const N: usize>(&self, of: impl Fn(f32) -> [f32; N]) -> [f32; N] {
        self.mean_of_directions(ALBEDO_DIRECTIONS, of)
    }

    /// The mean over `count` directions.
    fn mean_of_directions<const N: usize>(&self, count: u32, of: impl Fn(f32) -> [f32; N]) -> [f32; N] {
        let mut sum = [0.0; N];
        for i in 0..count {
            let FacetDirection { v_h, shadowing, .. } = self.direction(i, count);
            for (sum, x) in sum.iter_mut().zip(of(v_h as f32)) {
                *sum += x * shadowing as f32 / count as f32;
            }
        }
        sum
    }

    /// The cosine between viewer and facet of `count` facets that spread evenly over the lobe, each with the share of light that
    /// leaves the surface.
    pub fn cosines(&self, count: u32) -> impl Iterator<Item = (f32, f32)> {
        let is_mirror = self.alpha.iter().all(|&alpha| alpha <= MIRROR_ALPHA);
        (0..if is_mirror { 1 } else { count }).map(move |i| {
            if is_mirror {
                return (self.v.z as f32, 1.0);
            }
            let FacetDirection { v_h, shadowing, .. } = self.direction(i, count);
            (v_h as f32, shadowing as f32)
        })
    }

    /// The albedos of facets that reflect everything, Schlick's weight, or the curve of a dielectric of index `ior`.
    pub fn albedo(&self, ior: f32) -> FacetAlbedo {
        let [e, schlick, curve] =
            self.mean(|cos| [1.0, schlick_weight(cos.into()) as f32, dielectric_weight(cos, ior)]);
        FacetAlbedo::integrated([e, schlick, curve], self.mean_alpha())
    }

    /// The radiance of an environment averaged over the lobe, for facets of reflectance `f0` at normal incidence: by `count`
    /// directions from number `first` on, of `total` that the samples of a pixel share.
    pub fn radiance(&self, environment: &Environment, f0: f32, directions: LobeDirections) -> Rgb {
        if let Some(radiance) = environment.as_uniform() {
            return radiance;
        }
        let LobeDirections { first, count, total } = directions;
        let mut sum = Rgb::ZERO;
        for i in first..first.saturating_add(count) {
            let direction = self.direction(i, total);
            let weight = direction.shadowing as f32 * schlick(f0, direction.v_h);
            if weight > 0.0 {
                sum += environment.radiance(direction.l.as_vec3(), direction.solid_angle(total)) * weight;
            }
        }
        // The albedo is that of all directions: those of one sample may all point below the surface.
        let [albedo] = self.mean_of_directions(total.min(ALBEDO_DIRECTIONS), |cos| [schlick(f0, cos.into())]);
        if albedo > 0.0 { sum / (count as f32 * albedo) } else { Rgb::ZERO }
    }

    /// The share of light that the lobe reflects once, for facets of reflectance `f0` at normal incidence.
    pub fn single_scattering_albedo(&self, f0: f32) -> f32 {
        let [albedo] = self.mean(|cos| [schlick(f0, cos.into())]);
        albedo
    }
}

/// Schlick's Fresnel term.
pub(crate) fn schlick(f0: f32, cos: f64) -> f32 {
    f0 + (1.0 - f0) * schlick_weight(cos) as f32
}

/// Some of the directions that the samples of a pixel share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LobeDirections {
    first: u32,
    count: u32,
    total: u32,
}

impl LobeDirections {
    /// All of them.
    pub const ALL: LobeDirections = LobeDirections { first: 0, count: DIRECTIONS, total: DIRECTIONS };

    /// Those of sample `index` of `samples`.
    pub fn of_sample(index: u32, samples: u32) -> LobeDirections {
        let samples = samples.max(1);
        let count = DIRECTIONS.div_ceil(samples);
        LobeDirections { first: (index % samples) * count, count, total: count.saturating_mul(samples) }
    }
}
