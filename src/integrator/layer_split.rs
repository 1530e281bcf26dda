//! Splits the light at a surface among its specular layers and the base below them.

use crate::geometry::Rgb;
use crate::integrator::frame::Frame;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{set3, vec3};

/// Sets k_r of all reflecting points, and scales k_e + k_a I_a, k_d and k_s in place to the share that the layers above
/// leave to them. To be called once per batch, after v is known.
pub(crate) fn apply_specular_layers(frame: &Frame, batch: &mut ShadingBatch) {
    for i in batch.soa.reflecting_points() {
        let k = &batch.coefficients[batch.points[i].coefficients as usize];
        let (block, lane) = batch.soa.lane_mut(i);
        split_light(block, lane, k);
        let (k_e, k_a) = batch.layered_ke_ka(i);
        let base_radiance = k_e + k_a * frame.ambient_at(batch.n(i));
        let (block, lane) = batch.soa.lane_mut(i);
        block.set_base_radiance(lane, base_radiance);
    }
}

fn split_light(block: &mut PointBlock, i: usize, k: &Coefficients) {
    let layers = &k.layers;
    let cos = block.n(i).dot(block.v(i)) as f32;
    let increase = block.alpha2_increase[i];
    let albedo = layers.albedo(cos, widened(layers.alpha, increase), widened(layers.coat_alpha, increase));
    set3(&mut block.k_r, i, albedo.k_r.to_array());
    block.k_r_coat[i] = albedo.k_r_coat;
    block.base_share[i] = albedo.base_share;
    let below_coat = 1.0 - albedo.k_r_coat;
    if layers.covers_base {
        // The mapping of physical materials has put 1 − max F0 into k_d.
        let change = albedo.base_share - (1.0 - layers.dielectric_f0.max_element()) * below_coat;
        let k_d = vec3(&block.k_d, i) * below_coat + layers.base * change;
        set3(&mut block.k_d, i, k_d.max(Rgb::ZERO).to_array());
    }
    if albedo.k_r_coat > 0.0 {
        let k_s = vec3(&block.k_s, i) * below_coat;
        set3(&mut block.k_s, i, k_s.to_array());
    }
}

/// α of a lobe whose α² is increased by the variance of the normals that a sample covers.
#[inline(always)]
pub(crate) fn widened(alpha: f32, alpha2_increase: f32) -> f32 {
    (alpha * alpha + alpha2_increase).min(1.0).sqrt()
}
