//! A thin film over facets (KHR_materials_iridescence): light that its two boundaries reflect interferes (Belcour and Barla, “A
//! Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence”, SIGGRAPH 2017), by the formulas of the
//! extension's specification.

use std::f32::consts::PI;

use glam::{Mat3, Vec3};

use crate::integrator::layers::facets::AnisotropicFacets;
use crate::integrator::material::fresnel::{f0_from_ior, ior_from_reflectance, schlick_weight};
use crate::integrator::material::specular_layers::SpecularLayers;
use blinn_core::geometry::Rgb;

/// Facets over which the reflectance of a lobe is averaged.
const LOBE_FACETS: u32 = 16;
/// Films of less than this many nanometres fade into nothing.
const MIN_THICKNESS: f32 = 0.03;
/// Films of more nanometres have no colours.
const MAX_THICKNESS: f32 = 1e6;
/// Orders of interference.
const ORDERS: usize = 2;

/// From CIE XYZ to linear Rec. 709.
const XYZ_TO_RGB: Mat3 = Mat3::from_cols(
    Vec3::new(3.2404542, -0.969266, 0.0556434),
    Vec3::new(-1.5371385, 1.8760108, -0.2040259),
    Vec3::new(-0.4985314, 0.041556, 1.0572252),
);

/// The Fourier transforms of the colour matching functions X (two of its parts), Y and Z: amplitude, frequency in 1/m and variance.
const SENSITIVITIES: [[f32; 3]; 4] = [
    [5.4856e-13, 1.6810e6, 4.3278e9],
    [9.7470e-14, 2.2399e6, 4.5282e9],
    [4.4201e-13, 1.7953e6, 9.3046e9],
    [5.2481e-13, 2.2084e6, 6.6121e9],
];
/// Divisor of the amplitudes, so that white has Y = 1.
const WHITE: f32 = 1.0685e-7;

/// A film at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ThinFilm {
    /// Share of the surface that has the film.
    pub share: f32,
    /// Index of refraction, at least 1.
    pub ior: f32,
    /// Thickness in nanometres.
    pub thickness: f32,
}

/// Reflectances of the dielectric and of the metal of a surface, as far as it is each of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FilmReflectance {
    pub dielectric: Rgb,
    pub metal: Rgb,
}

/// A film over the facets of a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilmOverFacets {
    ior: f32,
    thickness: f32,
    /// Reflectance of the film's upper boundary at normal incidence.
    r0: f32,
    dielectric: Option<FilmBase>,
    metal: Option<FilmBase>,
    /// Weight of the dielectric's reflectance.
    dielectric_weight: f32,
}

/// The boundary below a film.
#[derive(Clone, Copy, Debug)]
struct FilmBase {
    /// Reflectance at normal incidence.
    r1: Rgb,
    /// −1 for the channels in which light changes its phase by π in the film as a whole, and 1 for the others.
    sign: Vec3,
}

impl ThinFilm {
    /// The film over the facets of `layers`.
    pub fn over(&self, layers: &SpecularLayers) -> FilmOverFacets {
        let thickness = self.thickness.clamp(0.0, MAX_THICKNESS);
        let t = (thickness / MIN_THICKNESS).min(1.0);
        let ior = 1.0 + (self.ior.max(1.0) - 1.0) * (t * t * (3.0 - 2.0 * t));
        let base = |f0: Rgb| FilmBase::new(ior, f0);
        let SpecularLayers { dielectric_f0, dielectric_f90, metal_f0, metallic, .. } = *layers;
        let has_dielectric = metallic < 1.0 && dielectric_f90 > 0.0;
        FilmOverFacets {
            ior,
            thickness,
            r0: f0_from_ior(f64::from(ior)) as f32,
            dielectric: has_dielectric.then(|| base(dielectric_f0 / dielectric_f90)),
            metal: (metallic > 0.0).then(|| base(metal_f0)),
            dielectric_weight: dielectric_f90.min(1.0),
        }
    }
}

impl FilmBase {
    /// The boundary between a film and a surface that reflects `f0` in air at normal incidence.
    fn new(film_ior: f32, f0: Rgb) -> FilmBase {
        let film = f64::from(film_ior);
        let channel = |f0: f32| {
            let ior = ior_from_reflectance(f64::from(f0));
            // Light reflected inside of the film at its upper boundary changes its phase, and at a denser base does not.
            (f0_from_ior(ior / film) as f32, if ior < film { 1.0 } else { -1.0 })
        };
        let [r, g, b] = f0.to_array().map(channel);
        FilmBase { r1: Rgb::new(r.0, g.0, b.0), sign: Vec3::new(r.1, g.1, b.1) }
    }

    /// The reflectance of film and base: `r12` is that of the film alone, `weight` Schlick's weight at the base, and `waves` the
    /// colour of each order in XYZ.
    fn reflectance(&self, r12: f32, weight: f32, waves: &[Vec3; ORDERS]) -> Rgb {
        let t121 = 1.0 - r12;
        let r23 = self.r1 + (Rgb::ONE - self.r1) * weight;
        let r123 = (r23 * r12).clamp(Rgb::splat(1e-5), Rgb::splat(0.9999));
        let amplitude = Rgb::new(r123.x.sqrt(), r123.y.sqrt(), r123.z.sqrt());
        let rs = r23 * (t121 * t121) / (Rgb::ONE - r123);
        let mut reflectance = rs + Rgb::splat(r12);
        let mut of_order = rs - Rgb::splat(t121);
        let mut sign = self.sign;
        for wave in waves {
            of_order *= amplitude;
            reflectance += of_order * 2.0 * (XYZ_TO_RGB * (*wave * sign));
            sign *= self.sign;
        }
        // Colours beyond Rec. 709 are the nearest within.
        reflectance.clamp(Rgb::ZERO, Rgb::ONE)
    }
}

impl FilmOverFacets {
    /// The reflectance of facets that light meets at cosine `cos`.
    pub fn reflectance(&self, cos: f32) -> FilmReflectance {
        let cos = cos.clamp(0.0, 1.0);
        let cos_inside = (1.0 - (1.0 - cos * cos) / (self.ior * self.ior)).max(0.0).sqrt();
        let [weight, weight_inside] = [cos, cos_inside].map(|cos| schlick_weight(cos.into()) as f32);
        let r12 = self.r0 + (1.0 - self.r0) * weight;
        let waves = waves(2.0 * self.ior * self.thickness * cos_inside);
        let of = |base: &Option<FilmBase>| {
            base.map_or(Rgb::ZERO, |base| base.reflectance(r12, weight_inside, &waves))
        };
        FilmReflectance { dielectric: of(&self.dielectric) * self.dielectric_weight, metal: of(&self.metal) }
    }

    /// The mean reflectance over a lobe.
    pub fn mean(&self, facets: &AnisotropicFacets) -> FilmReflectance {
        let mut sum = FilmReflectance::default();
        let mut weights = 0.0;
        for (cos, weight) in facets.cosines(LOBE_FACETS) {
            let FilmReflectance { dielectric, metal } = self.reflectance(cos);
            sum.dielectric += dielectric * weight;
            sum.metal += metal * weight;
            weights += weight;
        }
        let scale = if weights > 0.0 { 1.0 / weights } else { 0.0 };
        FilmReflectance { dielectric: sum.dielectric * scale, metal: sum.metal * scale }
    }
}

/// The colour in XYZ of light that has interfered once and twice, for a difference of optical paths in nanometres.
fn waves(path_difference: f32) -> [Vec3; ORDERS] {
    let phase = 2.0 * PI * 1e-9 * path_difference;
    let parts = SENSITIVITIES.map(|[amplitude, frequency, variance]| {
        let amplitude = amplitude * (2.0 * PI * variance).sqrt() / WHITE;
        let cos = libm::cosf(frequency * phase);
        let fade = libm::expf(-variance * phase * phase);
        let fade2 = fade * fade;
        // cos 2x, and exp(−(2x)²).
        [amplitude * cos * fade, amplitude * (2.0 * cos * cos - 1.0) * (fade2 * fade2)]
    });
    std::array::from_fn(|m| Vec3::new(parts[0][m] + parts[1][m], parts[2][m], parts[3][m]))
}
