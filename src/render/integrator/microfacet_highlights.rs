//! Highlights of physical materials: lights reflected in GGX lobes.

use crate::integrator::direct_light::IncidentLight;
use crate::integrator::material::directional_albedo::COAT_IOR;
use crate::integrator::material::fresnel::dielectric_weight;
use crate::integrator::surface::highlights::HighlightLobes;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{LANES, vec3};
use blinn_core::geometry::Rgb;

/// Factors of the highlights of a block's points.
pub(crate) struct LobeWeights {
    pub facets: [f32; LANES],
    pub coats: [f32; LANES],
    /// True for the exact Fresnel equations of dielectrics, which reflections have: rays find area lights in the same lobes. False
    /// for Schlick's approximation, which is up to a fifth lower at 60 degrees.
    pub has_exact_fresnel: bool,
}

impl LobeWeights {
    pub const ONE: LobeWeights =
        LobeWeights { facets: [1.0; LANES], coats: [1.0; LANES], has_exact_fresnel: false };
}

/// Adds I/r² times the highlights of a block's points to their current light, each lobe with a weight.
#[inline(always)]
pub(crate) fn add_highlights(block: &mut PointBlock, light: &IncidentLight, weights: &LobeWeights) {
    let mut reflected = [[0.0; LANES]; 3];
    let directions = Directions::new(block, light);
    let highlights = &block.highlights;
    let layers = &block.k.layers;
    let facets =
        weights.has_exact_fresnel.then_some(Dielectrics { ior: layers.ior, metallic: layers.metallic });
    add_lobes(block, &highlights.facets, light, &directions, &weights.facets, facets, &mut reflected);
    if highlights.any_coat {
        let coats = weights.has_exact_fresnel.then_some(Dielectrics::COATS);
        add_lobes(block, &highlights.coats, light, &directions, &weights.coats, coats, &mut reflected);
    }
    for c in 0..3 {
        for i in 0..LANES {
            block.current_light[c][i] += reflected[c][i];
        }
    }
}

/// The dielectrics of a lobe's facets.
#[derive(Clone, Copy)]
struct Dielectrics {
    /// Index of refraction.
    ior: [f32; LANES],
    /// Share of the facets that is metal instead.
    metallic: [f32; LANES],
}

impl Dielectrics {
    const COATS: Dielectrics = Dielectrics { ior: [COAT_IOR; LANES], metallic: [0.0; LANES] };
}

/// The unit vectors n, of specular lobes, l and v of points, rounded to f32: loops over them then have twice as many lanes.
struct Directions {
    n: [[f32; LANES]; 3],
    l: [[f32; LANES]; 3],
    v: [[f32; LANES]; 3],
    /// n·l; 0 for a light behind the triangle, where lobes end at it.
    n_dot_l: [f32; LANES],
}

impl Directions {
    #[inline(always)]
    fn new(block: &PointBlock, light: &IncidentLight) -> Directions {
        let zero = [[0.0; LANES]; 3];
        let mut directions = Directions { n: zero, l: zero, v: zero, n_dot_l: light.n_dot_l };
        for c in 0..3 {
            for i in 0..LANES {
                directions.n[c][i] = block.n_specular[c][i] as f32;
                directions.l[c][i] = light.l[c][i] as f32;
                directions.v[c][i] = block.v[c][i] as f32;
            }
        }
        if block.has_turned_normals {
            for i in 0..LANES {
                let n_dot_l = block.n_specular(i).dot(light.l(i)) as f32;
                directions.n_dot_l[i] = if light.n_g_dot_l[i] > 0.0 { n_dot_l } else { 0.0 };
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
    exact: Option<Dielectrics>,
    reflected: &mut [[f32; LANES]; 3],
) {
    let (mut lobe, mut weight) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        let [n, l, v] = [&directions.n, &directions.l, &directions.v].map(|of| vec3(of, i));
        [lobe[i], weight[i]] = lobes.evaluate(i, n, l, v, directions.n_dot_l[i]);
        if let Some(Dielectrics { ior, metallic }) = exact {
            let curve = dielectric_weight(0.5 * (l + v).length(), ior[i]);
            weight[i] = curve + (weight[i] - curve) * metallic[i];
        }
        let reflectance: Rgb = vec3(&lobes.f0, i) + vec3(&lobes.rise, i) * weight[i];
        let reflected = lobe[i] * (reflectance.element_sum() * (1.0 / 3.0));
        let max = block.highlights.max_share[i] * directions.n_dot_l[i];
        lobe[i] = if reflected > max { lobe[i] * (max / reflected) } else { lobe[i] };
        lobe[i] *= weights[i];
    }
    for c in 0..3 {
        for i in 0..LANES {
            let reflectance = lobes.f0[c][i] + lobes.rise[c][i] * weight[i];
            let light = light.irradiance[c][i];
            // The irradiance is 0 where n·l ≤ 0. There, and at other points, the other factors may be NaN.
            let counts = block.highlights.points >> i & 1 != 0 && light != 0.0 && directions.n_dot_l[i] > 0.0;
            reflected[c][i] += if counts { light * (reflectance * lobe[i]) } else { 0.0 };
        }
    }
}
