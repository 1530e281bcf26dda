//! A point with layers over the lecture's sum.
//!
//! From above: the clear coat, then the sheen, then the microfacets, perhaps under a thin film, then the diffuse or transmissive
//! base. What lies below a layer receives
//! what the layer does not reflect in the direction of view.

use glam::{DVec3, Vec3};

use crate::integrator::layers::coat::{CoatLobe, CoatNormal};
use crate::integrator::layers::facets::{AnisotropicFacets, Anisotropy};
use crate::integrator::layers::sheen::{Sheen, SheenLobe};
use crate::integrator::layers::thin_film::{FilmOverFacets, FilmReflectance, ThinFilm};
use crate::integrator::material::directional_albedo::{FacetAlbedo, FacetLobe};
use crate::integrator::material::fresnel::{dielectric_weight, schlick_weight};
use crate::integrator::material::highlight_lobe::{highlight_lobe, reflection_pdf};
use crate::integrator::material::specular_layers::SpecularLayers;
use crate::integrator::surface::highlights::{HighlightWidth, widened};
use blinn_core::geometry::Rgb;

/// The layers of a point, besides its [`SpecularLayers`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayeredPoint {
    /// k_d of the base, as if nothing covered it.
    pub k_d: Rgb,
    /// Share of light from behind that the base transmits diffusely, at first as if nothing covered it.
    pub transmitted: Rgb,
    /// The normals of the coat.
    pub coat: CoatNormal,
    /// The stretch of the microfacets.
    pub anisotropy: Option<Anisotropy>,
    pub sheen: Option<Sheen>,
    pub film: Option<ThinFilm>,
    /// The albedo of stretched microfacets in the point's view, once it is known.
    pub stretched_albedo: Option<FacetAlbedo>,
    /// The mean reflectance of the film over the lobe of the microfacets in the point's view, once it is known.
    pub film_mean: Option<FilmReflectance>,
    /// Share of ambient light that layers other than the base reflect. Set with the shares of light.
    pub k_a: Rgb,
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
    /// Share of light that passes the coat.
    pub below_coat: f32,
    /// Share of ambient light that layers other than the base reflect.
    pub k_a: Rgb,
}

/// The distribution of the microfacets' normals.
#[derive(Clone, Copy, Debug)]
enum FacetShape {
    /// The same in all directions around the normal. α is that of the lobe, widened by the normals that the sample covers.
    Isotropic { width: HighlightWidth, alpha: f32 },
    /// The facets that rays are reflected by, and α of highlights with a factor that fades narrow ones out.
    Anisotropic { rays: AnisotropicFacets, alpha: [f32; 2], scale: f32 },
}

/// The lobes of a point in its view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointLobes {
    n: Vec3,
    v: Vec3,
    shape: FacetShape,
    ior: f32,
    metallic: f32,
    facets: FacetLobe,
    film: Option<FilmLobe>,
    pub coat: CoatLobe,
    sheen: Option<SheenLobe>,
    base_share: f32,
    k_d: Rgb,
}

/// A film over the microfacets of a lobe.
#[derive(Clone, Copy, Debug)]
struct FilmLobe {
    film: FilmOverFacets,
    /// Factors of the film's reflectance.
    scale: FilmReflectance,
}

impl FilmLobe {
    /// The reflectance of facets that light meets at cosine `cos`.
    fn reflectance(&self, cos: f32) -> Rgb {
        let FilmReflectance { dielectric, metal } = self.film.reflectance(cos);
        dielectric * self.scale.dielectric + metal * self.scale.metal
    }
}

/// The microfacets of a point in its view, and what they leave to the base.
#[derive(Clone, Copy, Debug)]
struct Facets {
    lobe: FacetLobe,
    film: Option<FilmLobe>,
    base_share: f32,
}

impl Facets {
    /// Surfaces that reflect no surroundings.
    const NONE: Facets = Facets { lobe: FacetLobe::NONE, film: None, base_share: 1.0 };

    /// The same facets, which only the share `t` of light reaches.
    fn scaled(self, t: f32) -> Facets {
        let film = self.film.map(|FilmLobe { film, scale: FilmReflectance { dielectric, metal } }| {
            FilmLobe { film, scale: FilmReflectance { dielectric: dielectric * t, metal: metal * t } }
        });
        Facets { lobe: self.lobe.scaled(t), film, base_share: self.base_share * t }
    }
}

/// Light of a direction that lobes reflect, as shares of the lecture's irradiance: π f cos.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ReflectedShares {
    pub facets: Rgb,
    pub coat: Rgb,
    /// Share of layers that reflect light diffusely.
    pub diffuse: Rgb,
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
        let &LayerView { n, v, layers, .. } = view;
        let is_coated = layers.reflects && layers.coat > 0.0;
        let coat = CoatLobe::new(self.coat, v, if is_coated { layers.coat } else { 0.0 }, layers.coat_alpha);
        let below_coat = 1.0 - coat.lobe.albedo.x;
        let sheen = self.sheen.map(|sheen| sheen.lobe(n.as_vec3(), v.as_vec3()));
        let below_sheen = sheen.map_or(below_coat, |sheen| sheen.below * below_coat);
        let shape = self.facet_shape(view);
        let facets = if layers.reflects { self.facets(view, &shape) } else { Facets::NONE };
        let facets = facets.scaled(below_sheen);
        PointLobes {
            n: n.as_vec3(),
            v: v.as_vec3(),
            shape,
            ior: layers.ior,
            metallic: layers.metallic,
            facets: facets.lobe,
            film: facets.film,
            coat,
            sheen,
            base_share: facets.base_share,
            k_d: self.k_d,
        }
    }

    /// The microfacets in a view.
    fn facets(&self, view: &LayerView, shape: &FacetShape) -> Facets {
        let &LayerView { n, v, layers, alpha, .. } = view;
        let albedo = match shape {
            FacetShape::Isotropic { .. } => FacetAlbedo::new(n.dot(v) as f32, alpha, layers.ior),
            FacetShape::Anisotropic { rays, .. } => {
                self.stretched_albedo.unwrap_or_else(|| rays.albedo(layers.ior))
            }
        };
        let bare = SpecularLayers { coat: 0.0, ..layers }.combine(&albedo, FacetLobe::NONE);
        let bare = Facets { lobe: bare.facets, film: None, base_share: bare.base_share };
        let Some(film) = &self.film else { return bare };
        let FilmReflectance { dielectric, metal } =
            self.film_mean.or_else(|| self.film_mean_in(view)).unwrap_or_default();
        let [of_dielectric, of_metal] = [dielectric, metal].map(|mean| albedo.of_mean_reflectance(mean));
        let (share, metallic) = (film.share, layers.metallic);
        let mixed = |dielectric: Rgb, metal: Rgb| dielectric * (1.0 - metallic) + metal * metallic;
        let lobe = bare.lobe.scaled(1.0 - share);
        let scale = FilmReflectance {
            dielectric: of_dielectric.1 * ((1.0 - metallic) * share),
            metal: of_metal.1 * (metallic * share),
        };
        let base_share = 1.0 - of_dielectric.0.max_element();
        Facets {
            lobe: FacetLobe { albedo: lobe.albedo + mixed(of_dielectric.0, of_metal.0) * share, ..lobe },
            film: Some(FilmLobe { film: film.over(&layers), scale }),
            base_share: bare.base_share + (base_share - bare.base_share) * share,
        }
    }

    /// The mean reflectance of the film over the lobe of the microfacets in a view; `None` without a film.
    pub fn film_mean_in(&self, view: &LayerView) -> Option<FilmReflectance> {
        let film = self.film?.over(&view.layers);
        let facets = self.anisotropic_facets(view).unwrap_or_else(|| {
            AnisotropicFacets::new(view.n, view.n.any_orthonormal_vector(), view.v, [view.alpha; 2])
        });
        Some(film.mean(&facets))
    }

    /// Mean reflectance of the microfacets, which shapes the weights of rays of their lobe.
    pub fn mean_f0(&self, layers: &SpecularLayers) -> f32 {
        let bare = layers.mean_f0();
        let (Some(film), Some(mean)) = (self.film, self.film_mean) else { return bare };
        let mixed = mean.dielectric + (mean.metal - mean.dielectric) * layers.metallic;
        bare + (mixed.element_sum() * (1.0 / 3.0) - bare) * film.share
    }

    /// The anisotropic facets in a view, which rays are reflected by; `None` for isotropic ones.
    pub fn anisotropic_facets(&self, view: &LayerView) -> Option<AnisotropicFacets> {
        let &LayerView { n, v, layers, alpha2_increase, .. } = view;
        let of_layer = self.anisotropy?.alphas(layers.alpha);
        let alphas = of_layer.map(|alpha| widened(alpha, alpha2_increase));
        Some(AnisotropicFacets::new(n, self.anisotropy?.direction, v, alphas))
    }

    fn facet_shape(&self, view: &LayerView) -> FacetShape {
        let &LayerView { layers, alpha, alpha2_increase, .. } = view;
        let width = HighlightWidth::new(layers.alpha, alpha2_increase);
        match (self.anisotropy, self.anisotropic_facets(view)) {
            (Some(anisotropy), Some(rays)) => {
                let widths =
                    anisotropy.alphas(layers.alpha).map(|alpha| HighlightWidth::new(alpha, alpha2_increase));
                FacetShape::Anisotropic {
                    alpha: widths.map(|width| width.alpha2.sqrt()),
                    // A lobe that is narrow in one direction alone is a streak, which small lights have in mirrors.
                    scale: (widths[0].scale * widths[1].scale).sqrt(),
                    rays,
                }
            }
            _ => FacetShape::Isotropic { width, alpha },
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
            below_coat: self.below_coat(),
            k_a: self.sheen.map_or(Rgb::ZERO, |sheen| sheen.albedo * self.below_coat()),
        }
    }

    /// Share of light that passes the coat.
    fn below_coat(&self) -> f32 {
        1.0 - self.coat.lobe.albedo.x
    }

    /// The light from direction `l` that layers reflect diffusely: its share of the lecture's irradiance.
    pub fn reflect_diffuse(&self, l: Vec3) -> Rgb {
        self.sheen.map_or(Rgb::ZERO, |sheen| sheen.reflect(l) * self.below_coat())
    }

    /// The light from direction `l` that the lobes reflect. `n_dot_l` is n·l > 0 of the microfacets. `has_exact_fresnel` takes the
    /// exact Fresnel equations of dielectrics, and not Schlick's approximation.
    pub fn reflect(&self, l: Vec3, n_dot_l: f32, has_exact_fresnel: bool) -> ReflectedShares {
        let PointLobes { n, v, .. } = *self;
        let [lobe, schlick] = match &self.shape {
            FacetShape::Isotropic { width, .. } => {
                let [lobe, schlick] = highlight_lobe(n, l, v, n_dot_l, width.alpha2);
                [lobe * width.scale, schlick]
            }
            &FacetShape::Anisotropic { rays, alpha, scale } => {
                let [lobe, v_h] = rays.with_alpha(alpha).highlight(l);
                [lobe * scale, schlick_weight(v_h.into()) as f32]
            }
        };
        let weight = if has_exact_fresnel {
            let curve = dielectric_weight(0.5 * (l + v).length(), self.ior);
            curve + (schlick - curve) * self.metallic
        } else {
            schlick
        };
        let bare = self.facets.f0 + self.facets.rise * weight;
        let reflectance = self.film.map_or(bare, |film| bare + film.reflectance(0.5 * (l + v).length()));
        ReflectedShares {
            facets: reflectance * lobe,
            coat: self.coat.reflect(l, v, has_exact_fresnel),
            diffuse: self.reflect_diffuse(l),
        }
    }

    /// How the lobes spawn rays in direction `l`.
    pub fn pdfs(&self, l: Vec3) -> LobePdfs {
        let facets = match &self.shape {
            &FacetShape::Isotropic { alpha, .. } => {
                LobePdf { density: reflection_pdf(self.n, l, self.v, alpha * alpha), alpha }
            }
            FacetShape::Anisotropic { rays, .. } => {
                LobePdf { density: rays.pdf(l), alpha: rays.mean_alpha() }
            }
        };
        LobePdfs { facets, coat: LobePdf { density: self.coat.pdf(l, self.v), alpha: self.coat.alpha } }
    }
}

#[cfg(test)]
mod tests;
