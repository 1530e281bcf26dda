//! The term k_r · L_r: light that specular layers reflect from the surroundings.

use crate::geometry::Rgb;
use crate::integrator::frame::Frame;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{LANES, set3, vec3};

/// Splits the light of all reflecting points among their layers: sets k_r, and reduces k_e + k_a I_a, k_d and k_s to the
/// share that the layers above leave to them.
pub(crate) fn split_light_among_layers(frame: &Frame, points: &mut ShadingBatch) {
    for i in reflecting_points(points) {
        let k = *points.coefficients(i);
        let (block, lane) = points.soa.lane_mut(i);
        split_light(block, lane, &k);
        let (k_e, k_a) = points.emission_and_ambient(i);
        let unlit = k_e + k_a * frame.ambient_at(points.n(i));
        let (block, lane) = points.soa.lane_mut(i);
        block.set_unlit(lane, unlit);
    }
}

fn split_light(block: &mut PointBlock, i: usize, k: &Coefficients) {
    let layers = &k.layers;
    let cos = block.n(i).dot(block.v(i)) as f32;
    let roughness = block.roughness[i];
    let albedo = layers.albedo(cos, widened(layers.alpha, roughness), widened(layers.coat_alpha, roughness));
    set3(&mut block.k_r, i, albedo.specular.to_array());
    block.k_coat[i] = albedo.coat;
    block.base_share[i] = albedo.base;
    let below_coat = 1.0 - albedo.coat;
    if layers.cover_base {
        // The mapping of physical materials has put 1 − max F0 into k_d.
        let change = albedo.base - (1.0 - layers.dielectric_f0.max_element()) * below_coat;
        let k_d = vec3(&block.k_d, i) * below_coat + layers.base * change;
        set3(&mut block.k_d, i, k_d.max(Rgb::ZERO).to_array());
    }
    if albedo.coat > 0.0 {
        let k_s = vec3(&block.k_s, i) * below_coat;
        set3(&mut block.k_s, i, k_s.to_array());
    }
}

/// α of a lobe over normals of that variance.
#[inline(always)]
pub(crate) fn widened(alpha: f32, roughness: f32) -> f32 {
    (alpha * alpha + roughness).min(1.0).sqrt()
}

/// Indices of the points that reflect their surroundings.
pub(crate) fn reflecting_points(points: &mut ShadingBatch) -> Vec<usize> {
    let mut indices = Vec::new();
    for (b, (block, count)) in points.soa.blocks_mut().enumerate() {
        let mut mask = block.reflecting & (u32::MAX >> (LANES - count));
        while mask != 0 {
            indices.push(b * LANES + mask.trailing_zeros() as usize);
            mask &= mask - 1;
        }
    }
    indices
}
