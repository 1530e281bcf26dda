//! Highlights of physical materials: the light of light sources that GGX microfacets reflect.
//!
//! They take the place of the lecture's k_s max(0, n·h)^p, with the lobes of the reflections, so that a light and what is
//! around it are reflected alike. Metals need that: the tail of GGX is far wider than that of a power of a cosine.

use glam::Vec3;

use crate::integrator::material::directional_albedo::FacetLobe;
use crate::integrator::material::highlight_lobe::highlight_lobe;
use crate::integrator::surface::soa::{HIT_LANES, LANES, LaneArray, LaneArray3, ZERO3_F32, set3, vec3};

/// Smallest α of highlights. Light sources have no size, and so no image in a mirror: narrower lobes fade out.
pub(crate) const MIN_HIGHLIGHT_ALPHA: f32 = 0.01;

/// α of a lobe whose α² is increased by the variance of the normals that a sample covers.
#[inline(always)]
pub(crate) fn widened(alpha: f32, alpha2_increase: f32) -> f32 {
    (alpha * alpha + alpha2_increase).min(1.0).sqrt()
}

/// The width of a highlight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HighlightWidth {
    /// α².
    pub alpha2: f32,
    /// Factor of the lobe's height, below 1 where it fades out.
    pub scale: f32,
}

impl HighlightWidth {
    /// The highlight of a layer with GGX α, and the increase of its α² by the normals that the sample covers.
    #[inline(always)]
    pub fn new(alpha: f32, alpha2_increase: f32) -> HighlightWidth {
        let scale = (alpha / MIN_HIGHLIGHT_ALPHA).min(1.0);
        let alpha = alpha.max(MIN_HIGHLIGHT_ALPHA);
        HighlightWidth { alpha2: (alpha * alpha + alpha2_increase).min(1.0), scale }
    }
}

/// The lobes of the points of a block.
#[derive(Clone)]
pub(crate) struct Highlights {
    /// The points that have highlights, as a bit mask.
    pub points: u32,
    /// True if any point has a coat.
    pub any_coat: bool,
    pub facets: HighlightLobes,
    /// Maximum of reflected light over irradiance, the mean of the channels. Infinite where the eye sees the points.
    pub max_share: [f32; LANES],
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

    /// Sets the lobes of all points. `alpha` is the layers' α, and `alpha2_increase` its increase by the normals that the sample
    /// covers.
    #[inline(always)]
    fn set(&mut self, lobes: &FacetLobeLanes, alpha: &[f32; LANES], alpha2_increase: &[f32; LANES]) {
        for i in 0..LANES {
            let HighlightWidth { alpha2, scale } = HighlightWidth::new(alpha[i], alpha2_increase[i]);
            self.alpha2[i] = alpha2;
            set3(&mut self.f0, i, (vec3(&lobes.f0, i) * scale).to_array());
            set3(&mut self.rise, i, (vec3(&lobes.rise, i) * scale).to_array());
        }
    }

    /// The lobe of point `i` for unit vectors n, l and v with n·l > 0, and Schlick's weight: see [`highlight_lobe`].
    #[inline(always)]
    pub fn evaluate(&self, i: usize, n: Vec3, l: Vec3, v: Vec3, n_l: f32) -> [f32; 2] {
        highlight_lobe(n, l, v, n_l, self.alpha2[i])
    }
}

impl Highlights {
    /// No highlights.
    pub const ZERO: Highlights = Highlights {
        points: 0,
        any_coat: false,
        max_share: [f32::INFINITY; LANES],
        facets: HighlightLobes::ZERO,
        coats: HighlightLobes::ZERO,
    };

    /// Removes all highlights.
    pub fn clear(&mut self) {
        self.points = 0;
        self.max_share = [f32::INFINITY; LANES];
    }

    /// Sets the highlights of all points, whose microfacets have these lobes.
    #[inline(always)]
    pub fn set_facets(
        &mut self,
        points: u32,
        lobes: &FacetLobeLanes,
        alpha: &[f32; LANES],
        alpha2_increase: &[f32; LANES],
    ) {
        self.points = points;
        self.any_coat = false;
        self.facets.set(lobes, alpha, alpha2_increase);
    }

    /// Sets the highlights of the coats as well.
    #[inline(always)]
    pub fn set_coats(
        &mut self,
        lobes: &FacetLobeLanes,
        alpha: &[f32; LANES],
        alpha2_increase: &[f32; LANES],
    ) {
        self.any_coat = true;
        self.coats.set(lobes, alpha, alpha2_increase);
    }
}

/// The reflectance of the facets of a block, in structure of arrays: see [`FacetLobe`].
#[derive(Clone, Copy)]
pub(crate) struct FacetLobeLanes {
    f0: [[f32; LANES]; 3],
    rise: [[f32; LANES]; 3],
}

impl FacetLobeLanes {
    pub const ZERO: FacetLobeLanes = FacetLobeLanes { f0: [[0.0; LANES]; 3], rise: [[0.0; LANES]; 3] };

    #[inline(always)]
    pub fn set(&mut self, i: usize, lobe: &FacetLobe) {
        set3(&mut self.f0, i, lobe.f0.to_array());
        set3(&mut self.rise, i, lobe.rise.to_array());
    }
}
