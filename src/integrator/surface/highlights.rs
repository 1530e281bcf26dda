//! Highlights of physical materials: the light of light sources that GGX microfacets reflect.
//!
//! They take the place of the lecture's k_s max(0, n·h)^p, with the lobes of the reflections, so that a light and what is
//! around it are reflected alike. Metals need that: the tail of GGX is far wider than that of a power of a cosine.

use glam::DVec3;

use crate::integrator::material::directional_albedo::FacetLobe;
use crate::integrator::material::highlight_lobe::highlight_lobe;
use crate::integrator::material::specular_layers::{LayerLobes, SpecularLayers};
use crate::integrator::surface::soa::{HIT_LANES, LANES, LaneArray, LaneArray3, ZERO3_F32, set3};

/// Smallest α of highlights. Light sources have no size, and so no image in a mirror: narrower lobes fade out.
const MIN_HIGHLIGHT_ALPHA: f32 = 0.01;

/// The lobes of the points of a block.
#[derive(Clone)]
pub(crate) struct Highlights {
    /// The points that have highlights, as a bit mask.
    pub points: u32,
    /// True if any point has a coat.
    pub any_coat: bool,
    pub facets: HighlightLobes,
    /// Set if any point has a coat.
    pub coats: HighlightLobes,
}

/// One lobe of each point.
#[derive(Clone)]
pub(crate) struct HighlightLobes {
    /// α².
    alpha2: LaneArray<f32>,
    /// Reflectance at normal incidence.
    pub f0: LaneArray3<f32>,
    /// Rise of the reflectance to grazing incidence.
    pub rise: LaneArray3<f32>,
}

impl HighlightLobes {
    const ZERO: HighlightLobes =
        HighlightLobes { alpha2: [1.0; LANES + HIT_LANES], f0: ZERO3_F32, rise: ZERO3_F32 };

    #[inline(always)]
    fn set(&mut self, i: usize, lobe: &FacetLobe, alpha: f32, alpha2_increase: f32) {
        let scale = (alpha / MIN_HIGHLIGHT_ALPHA).min(1.0);
        let alpha = alpha.max(MIN_HIGHLIGHT_ALPHA);
        self.alpha2[i] = (alpha * alpha + alpha2_increase).min(1.0);
        set3(&mut self.f0, i, (lobe.f0 * scale).to_array());
        set3(&mut self.rise, i, (lobe.rise * scale).to_array());
    }

    /// The lobe of point `i` for unit vectors n, l and v, and Schlick's weight: see [`highlight_lobe`].
    #[inline(always)]
    pub fn evaluate(&self, i: usize, n: DVec3, l: DVec3, v: DVec3) -> [f32; 2] {
        highlight_lobe(n, l, v, f64::from(self.alpha2[i])).map(|x| x as f32)
    }
}

impl Highlights {
    /// No highlights.
    pub const ZERO: Highlights =
        Highlights { points: 0, any_coat: false, facets: HighlightLobes::ZERO, coats: HighlightLobes::ZERO };

    /// Removes all highlights.
    pub fn clear(&mut self) {
        self.points = 0;
    }

    /// Sets the highlights of point `i`, whose layers have these lobes, if it `has_highlights`. `alpha2_increase` is the
    /// increase of α² by the normals that the sample covers.
    #[inline(always)]
    pub fn set(
        &mut self,
        i: usize,
        has_highlights: bool,
        lobes: &LayerLobes,
        layers: &SpecularLayers,
        alpha2_increase: f32,
    ) {
        self.points |= u32::from(has_highlights) << i;
        self.facets.set(i, &lobes.facets, layers.alpha, alpha2_increase);
        self.coats.set(i, &lobes.coat, layers.coat_alpha, alpha2_increase);
    }
}
