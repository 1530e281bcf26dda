//! The specular layers of a surface: what they reflect in total, and what reaches the base below them.

use crate::integrator::material::directional_albedo::{COAT_IOR, FacetAlbedo, FacetLobe};
use blinn_core::geometry::Rgb;

/// The layers of a surface that reflect its surroundings: a clear coat over microfacets of metal and dielectric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecularLayers {
    /// False for surfaces that reflect no surroundings.
    pub reflects: bool,
    /// True if the base receives only what the layers let through. False for MTL's literal sum.
    pub covers_base: bool,
    /// True if highlights of lights have the shape of the layers' lobes, and false if they are the lecture's.
    pub has_highlights: bool,
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

/// The lobes of the layers for a direction of view, and the share of light that they leave to the base. A share of the light
/// that arrives from that direction is also, by reciprocity, the weight of the light that leaves towards it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerLobes {
    /// The microfacets, below the coat. Their albedo is k_r.
    pub facets: FacetLobe,
    /// The coat, which is grey. Its albedo is its k_r.
    pub coat: FacetLobe,
    /// Share of the light that reaches the diffuse or transmissive base.
    pub base_share: f32,
}

impl SpecularLayers {
    /// No layers.
    pub const NONE: SpecularLayers = SpecularLayers {
        reflects: false,
        covers_base: false,
        has_highlights: false,
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

    /// Returns the lobe of each layer seen at cosine `cos` to the normal. The sum of the albedos and of the base's share is at
    /// most 1.
    ///
    /// `alpha` and `coat_alpha` are those of the layers, with the variance of the normals that a sample covers.
    pub fn lobes(&self, cos: f32, alpha: f32, coat_alpha: f32) -> LayerLobes {
        if !self.reflects {
            return LayerLobes { facets: FacetLobe::NONE, coat: FacetLobe::NONE, base_share: 1.0 };
        }
        let facets = FacetAlbedo::new(cos, alpha, self.ior);
        let has_coat = self.coat > 0.0;
        let coat =
            if has_coat { FacetAlbedo::new(cos, coat_alpha, COAT_IOR).coat() } else { FacetLobe::NONE };
        self.combine(&facets, coat)
    }

    /// [`SpecularLayers::lobes`] of layers that reflect, given the values of the microfacets and the lobe of a full coat. Free
    /// of branches, so that loops over it are vectorised.
    #[inline(always)]
    pub(crate) fn combine(&self, facets: &FacetAlbedo, coat: FacetLobe) -> LayerLobes {
        let has_dielectric = self.metallic < 1.0 && self.dielectric_f90 > 0.0;
        let dielectric = facets.dielectric(self.dielectric_f0, self.dielectric_f90);
        let dielectric = if has_dielectric { dielectric } else { FacetLobe::NONE };
        let mixed = dielectric.mixed(facets.metal(self.metal_f0, self.metal_f90), self.metallic);
        let lobe = if self.metallic > 0.0 { mixed } else { dielectric };
        let base_share = if self.covers_base { 1.0 - dielectric.albedo.max_element() } else { 1.0 };
        let coat = if self.coat > 0.0 { coat.scaled(self.coat) } else { FacetLobe::NONE };
        let below_coat = 1.0 - coat.albedo.x;
        LayerLobes { facets: lobe.scaled(below_coat), coat, base_share: base_share * below_coat }
    }
}
