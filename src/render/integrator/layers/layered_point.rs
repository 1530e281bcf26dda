//! A point with layers over the lecture's sum.
//!
//! From above: the clear coat, then the microfacets, then the diffuse or transmissive base. What lies below a layer receives
//! what the layer does not reflect in the direction of view.

use glam::{DVec3, Vec3};

use crate::integrator::layers::coat::{CoatLobe, CoatNormal};
use crate::integrator::material::directional_albedo::{FacetAlbedo, FacetLobe};
use crate::integrator::material::fresnel::dielectric_weight;
use crate::integrator::material::highlight_lobe::{highlight_lobe, reflection_pdf};
use crate::integrator::material::specular_layers::SpecularLayers;
use crate::integrator::surface::highlights::HighlightWidth;
use blinn_core::geometry::Rgb;

/// The layers of a point, besides its [`SpecularLayers`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayeredPoint {
    /// k_d of the base, as if nothing covered it.
    pub k_d: Rgb,
    /// The normals of the coat.
    pub coat: CoatNormal,
}

/// How a point is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerView {
    /// Normal of the specular lobes.
    pub n: DVec3,
    /// Unit direction to the viewer.
    pub v: DVec3,
    /// The coat and the microfacets.
    pub layers: SpecularLayers,
    /// α of the microfacets, widened by the normals that the sample covers.
    pub alpha: f32,
    /// Increase of α² of the microfacets by these normals.
    pub alpha2_increase: f32,
}

/// The shares of light that the layers of a point reflect to the viewer, and that reach those below.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerShares {
    /// k_r of the microfacets.
    pub facets: Rgb,
    /// k_r of the coat.
    pub coat: f32,
    /// Share of light that reaches the base.
    pub base: f32,
    /// k_d as far as light reaches it.
    pub k_d: Rgb,
}

/// The lobes of a point in its view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointLobes {
    n: Vec3,
    v: Vec3,
    width: HighlightWidth,
    alpha: f32,
    ior: f32,
    metallic: f32,
    facets: FacetLobe,
    pub coat: CoatLobe,
    base_share: f32,
    k_d: Rgb,
}

/// Light of a direction that lobes reflect, as shares of the lecture's irradiance: π f cos.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ReflectedShares {
    pub facets: Rgb,
    pub coat: Rgb,
}

/// How a lobe spawns rays in a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LobePdf {
    /// Density per steradian.
    pub density: f32,
    /// GGX α of the lobe.
    pub alpha: f32,
}

/// How the lobes of a point spawn rays in a direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LobePdfs {
    pub facets: LobePdf,
    pub coat: LobePdf,
}

impl LayeredPoint {
    /// The lobes of the point, seen in a view.
    pub fn lobes(&self, view: &LayerView) -> PointLobes {
        let &LayerView { n, v, layers, alpha, alpha2_increase } = view;
        let is_coated = layers.reflects && layers.coat > 0.0;
        let coat = CoatLobe::new(self.coat, v, if is_coated { layers.coat } else { 0.0 }, layers.coat_alpha);
        let below_coat = 1.0 - coat.lobe.albedo.x;
        let (facets, base_share) = if layers.reflects {
            let albedo = FacetAlbedo::new(n.dot(v) as f32, alpha, layers.ior);
            let uncoated = SpecularLayers { coat: 0.0, ..layers }.combine(&albedo, FacetLobe::NONE);
            (uncoated.facets, uncoated.base_share)
        } else {
            (FacetLobe::NONE, 1.0)
        };
        PointLobes {
            n: n.as_vec3(),
            v: v.as_vec3(),
            width: HighlightWidth::new(layers.alpha, alpha2_increase),
            alpha,
            ior: layers.ior,
            metallic: layers.metallic,
            facets: facets.scaled(below_coat),
            coat,
            base_share: base_share * below_coat,
            k_d: self.k_d,
        }
    }
}

impl PointLobes {
    /// The shares of light that the layers reflect and let through.
    pub fn shares(&self) -> LayerShares {
        LayerShares {
            facets: self.facets.albedo,
            coat: self.coat.lobe.albedo.x,
            base: self.base_share,
            k_d: self.k_d * self.base_share,
        }
    }

    /// Share of light that passes the coat.
    pub fn below_coat(&self) -> f32 {
        1.0 - self.coat.lobe.albedo.x
    }

    /// The light from direction `l` that the lobes reflect. `n_dot_l` is n·l > 0 of the microfacets. `has_exact_fresnel` takes the
    /// exact Fresnel equations of dielectrics, and not Schlick's approximation.
    pub fn reflect(&self, l: Vec3, n_dot_l: f32, has_exact_fresnel: bool) -> ReflectedShares {
        let PointLobes { n, v, width, .. } = *self;
        let [lobe, schlick] = highlight_lobe(n, l, v, n_dot_l, width.alpha2);
        let weight = if has_exact_fresnel {
            let curve = dielectric_weight(0.5 * (l + v).length(), self.ior);
            curve + (schlick - curve) * self.metallic
        } else {
            schlick
        };
        ReflectedShares {
            facets: (self.facets.f0 + self.facets.rise * weight) * (lobe * width.scale),
            coat: self.coat.reflect(l, v, has_exact_fresnel),
        }
    }

    /// How the lobes spawn rays in direction `l`.
    pub fn pdfs(&self, l: Vec3) -> LobePdfs {
        let facets = reflection_pdf(self.n, l, self.v, self.alpha * self.alpha);
        LobePdfs {
            facets: LobePdf { density: facets, alpha: self.alpha },
            coat: LobePdf { density: self.coat.pdf(l, self.v), alpha: self.coat.alpha },
        }
    }
}

#[cfg(test)]
mod tests;
