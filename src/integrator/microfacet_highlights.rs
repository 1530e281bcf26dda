//! Adds the highlights of physical materials to the light of a light source.

use crate::integrator::direct_light::IncidentLight;
use crate::integrator::surface::highlights::HighlightLobes;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::LANES;

/// Adds I/r² times the highlights of a block's points to their current light.
#[inline(always)]
pub(crate) fn add_highlights(block: &mut PointBlock, light: &IncidentLight) {
    let mut reflected = [[0.0; LANES]; 3];
    let highlights = &block.highlights;
    add_lobes(block, &highlights.facets, light, &mut reflected);
    if highlights.any_coat {
        add_lobes(block, &highlights.coats, light, &mut reflected);
    }
    for c in 0..3 {
        for i in 0..LANES {
            block.current_light[c][i] += reflected[c][i];
        }
    }
}

/// Adds the light that one lobe of each point reflects.
#[inline(always)]
fn add_lobes(
    block: &PointBlock,
    lobes: &HighlightLobes,
    light: &IncidentLight,
    reflected: &mut [[f32; LANES]; 3],
) {
    let (mut lobe, mut weight) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        [lobe[i], weight[i]] = lobes.evaluate(i, block.n(i), light.l(i), block.v(i));
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
