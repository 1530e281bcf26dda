//! The boundary of a body of glass: what it reflects of the light that meets it from either side.

use crate::integrator::layers::thin_film::FilmOverFacets;
use crate::integrator::material::fresnel::fresnel_dielectric;
use blinn_core::geometry::Rgb;

/// A boundary that a path meets from one side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DielectricBoundary {
    /// Index of refraction behind the boundary over that in front of it.
    pub eta: f64,
    /// Weight of the reflection.
    pub f90: f32,
    /// Film on the outside.
    pub film: Option<BoundaryFilm>,
}

/// A thin film on the outside of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BoundaryFilm {
    pub film: FilmOverFacets,
    /// Share of the boundary that has the film.
    pub share: f32,
    /// True if the path meets the boundary from the outside.
    pub entering: bool,
}

impl DielectricBoundary {
    /// The share of light that is reflected at cosine `cos` of incidence, by colour.
    pub fn reflectance(&self, cos: f64) -> Rgb {
        let &DielectricBoundary { eta, f90, film } = self;
        let bare =
            Rgb::splat(if eta == 1.0 { 0.0 } else { fresnel_dielectric(cos, eta) as f32 * f90.min(1.0) });
        let Some(BoundaryFilm { film, share, entering }) = film else { return bare };
        let cos2_behind = 1.0 - (1.0 - cos * cos) / (eta * eta);
        // A film reflects as much on both sides of refracted light.
        let cos_outside = match entering {
            true => cos,
            false if cos2_behind <= 0.0 => return bare,
            false => cos2_behind.sqrt(),
        };
        bare + (film.reflectance(cos_outside as f32).dielectric - bare) * share
    }
}
