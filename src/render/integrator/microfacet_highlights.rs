//! Highlights of physical materials: lights reflected in GGX lobes.

use crate::integrator::direct_light::IncidentLight;
use crate::integrator::surface::highlights::HighlightLobes;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{LANES, vec3};
use blinn_core::geometry::Rgb;

/// Factors of the highlights of a block's points.
pub(crate) struct LobeWeights {
    pub facets: [f32; LANES],
    pub coats: [f32; LANES],
}

impl LobeWeights {
    pub const ONE: LobeWeights = LobeWeights { facets: [1.0; LANES], coats: [1.0; LANES] };
}

/// Adds I/r² times the highlights of a block's points to their current light.
#[inline(always)]
pub(crate) fn add_highlights(block: &mut PointBlock, light: &IncidentLight) {
    add_weighted_highlights(block, light, &LobeWeights::ONE);
}

/// [`add_highlights`], each lobe with a weight.
#[inline(always)]
pub(crate) fn add_weighted_highlights(block: &mut PointBlock, light: &IncidentLight, weights: &LobeWeights) {
    let mut reflected = [[0.0; LANES]; 3];
    let directions = Directions::new(block, light);
    let highlights = &block.highlights;
    add_lobes(block, &highlights.facets, light, &directions, &weights.facets, &mut reflected);
    if highlights.any_coat {
        add_lobes(block, &highlights.coats, light, &directions, &weights.coats, &mut reflected);
    }
    for c in 0..3 {
        for i in 0..LANES {
            block.current_light[c][i] += reflected[c][i];
        }
    }
}

/// The unit vectors n, l and v of points, rounded to f32: loops over them then have twice as many lanes.
struct Directions {
    n: [[f32; LANES]; 3],
    l: [[f32; LANES]; 3],
    v: [[f32; LANES]; 3],
}

impl Directions {
    #[inline(always)]
    fn new(block: &PointBlock, light: &IncidentLight) -> Directions {
        let zero = [[0.0; LANES]; 3];
        let mut directions = Directions { n: zero, l: zero, v: zero };
        for c in 0..3 {
            for i in 0..LANES {
                directions.n[c][i] = block.n[c][i] as f32;
                directions.l[c][i] = light.l[c][i] as f32;
                directions.v[c][i] = block.v[c][i] as f32;
            }
        }
        directions
    }
}

/// Adds the light that one lobe of each point reflects.
#[inline(always)]
fn add_lobes(
    block: &PointBlock,
    lobes: &HighlightLobes,
    light: &IncidentLight,
    directions: &Directions,
    weights: &[f32; LANES],
    reflected: &mut [[f32; LANES]; 3],
) {
    let (mut lobe, mut weight) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        let [n, l, v] = [&directions.n, &directions.l, &directions.v].map(|of| vec3(of, i));
        [lobe[i], weight[i]] = lobes.evaluate(i, n, l, v, light.n_dot_l[i]);
        let reflectance: Rgb = vec3(&lobes.f0, i) + vec3(&lobes.rise, i) * weight[i];
        let reflected = lobe[i] * (reflectance.element_sum() * (1.0 / 3.0));
        let max = block.highlights.max_share[i] * light.n_dot_l[i];
        lobe[i] = if reflected > max { lobe[i] * (max / reflected) } else { lobe[i] };
        lobe[i] *= weights[i];
    }
    for c in 0..3 {
        for i in 0..LANES {
            let reflectance = lobes.f0[c][i] + lobes.rise[c][i] * weight[i];
            let light = light.irradiance[c][i];
            // The irradiance is 0 where n·l ≤ 0. There, and at other points, the other factors may be NaN.
            let counts = block.highlights.points >> i & 1 != 0 && light != 0.0;
            reflected[c][i] += if counts { light * (reflectance * lobe[i]) } else { 0.0 };
        }
    }
}
