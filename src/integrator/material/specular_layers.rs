//! The specular layers of a surface: what they reflect in total, and what reaches the base below them.

use crate::geometry::Rgb;
use crate::integrator::material::directional_albedo::{FacetAlbedo, coat_albedo};

/// The layers of a surface that reflect its surroundings: a clear coat over microfacets of metal and dielectric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularLayers {
    /// False for surfaces that reflect no surroundings.
    pub reflects: bool,
    /// True if the base receives only what the layers let through. False for MTL's literal sum.
    pub covers_base: bool,
    /// Diffuse colour of the base, as if nothing covered it.
    pub base: Rgb,
    /// GGX α of the microfacets: the square of the perceptual roughness.
    pub alpha: f32,
    /// Share of the microfacets that is metal.
    pub metallic: f32,
    /// Reflectance of the metal at normal incidence.
    pub metal_f0: Rgb,
    /// Reflectance of the metal at grazing incidence.
    pub metal_f90: Rgb,
    /// Reflectance of the dielectric at normal incidence.
    pub dielectric_f0: Rgb,
    /// Reflectance of the dielectric at grazing incidence.
    pub dielectric_f90: f32,
    /// Index of refraction, which shapes the curve between the two.
    pub ior: f32,
    /// The occlusion map: share of the environment that reaches the microfacets where no ray is traced.
    pub occlusion: f32,
    /// Share of the surface that has a clear coat of index 1.5.
    pub coat: f32,
    /// GGX α of the coat.
    pub coat_alpha: f32,
}

/// Shares of the light that arrives from the direction of view, which by reciprocity are the weights of what is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerAlbedo {
    /// k_r of the microfacets, below the coat.
    pub k_r: Rgb,
    /// k_r of the coat.
    pub k_r_coat: f32,
    /// Share of the light that reaches the diffuse or transmissive base.
    pub base_share: f32,
}

impl SpecularLayers {
    /// No layers.
    pub const NONE: SpecularLayers = SpecularLayers {
        reflects: false,
        covers_base: false,
        base: Rgb::ZERO,
        alpha: 1.0,
        metallic: 0.0,
        metal_f0: Rgb::ZERO,
        metal_f90: Rgb::ZERO,
        dielectric_f0: Rgb::ZERO,
        dielectric_f90: 0.0,
        ior: 1.5,
        occlusion: 1.0,
        coat: 0.0,
        coat_alpha: 1.0,
    };

    /// Layers without reflectance that cover the base.
    pub(crate) const COVERING: SpecularLayers =
        SpecularLayers { reflects: true, covers_base: true, ..SpecularLayers::NONE };

    /// Mean reflectance of the microfacets at normal incidence, which shapes the lobe.
    pub(crate) fn mean_f0(&self) -> f32 {
        let f0 = self.dielectric_f0 + (self.metal_f0 - self.dielectric_f0) * self.metallic;
        f0.element_sum() / 3.0
    }

    /// Returns the albedo of each layer seen at cosine `cos` to the normal. The sum of all is at most 1.
    ///
    /// `alpha` and `coat_alpha` are those of the layers, with the variance of the normals that a sample covers.
    pub fn albedo(&self, cos: f32, alpha: f32, coat_alpha: f32) -> LayerAlbedo {
        if !self.reflects {
            return LayerAlbedo { k_r: Rgb::ZERO, k_r_coat: 0.0, base_share: 1.0 };
        }
        let facets = FacetAlbedo::new(cos, alpha, self.ior);
        let coat_albedo = if self.coat > 0.0 { coat_albedo(cos, coat_alpha) } else { 0.0 };
        self.combine(&facets, coat_albedo)
    }

    /// [`SpecularLayers::albedo`] of layers that reflect, given the values of the microfacets and the albedo of a full coat.
    /// Free of branches, so that loops over it are vectorised.
    #[inline(always)]
    pub(crate) fn combine(&self, facets: &FacetAlbedo, coat_albedo: f32) -> LayerAlbedo {
        let has_dielectric = self.metallic < 1.0 && self.dielectric_f90 > 0.0;
        let dielectric = facets.dielectric(self.dielectric_f0, self.dielectric_f90);
        let dielectric = if has_dielectric { dielectric } else { Rgb::ZERO };
        let metal = facets.metal(self.metal_f0, self.metal_f90);
        let mixed = dielectric + (metal - dielectric) * self.metallic;
        let k_r = if self.metallic > 0.0 { mixed } else { dielectric };
        let base_share = if self.covers_base { 1.0 - dielectric.max_element() } else { 1.0 };
        let k_r_coat = if self.coat > 0.0 { self.coat * coat_albedo } else { 0.0 };
        let below_coat = 1.0 - k_r_coat;
        LayerAlbedo { k_r: k_r * below_coat, k_r_coat, base_share: base_share * below_coat }
    }
}
