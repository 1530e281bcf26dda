//! The term k_r · L_r: light that specular layers reflect from the surroundings.

use crate::geometry::Rgb;
use crate::integrator::frame::Frame;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::material::environment_lobe::{LOBE_DIRECTIONS, Lobe, LobeSubset};
use crate::integrator::sample::SampleStream;
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{LANES, set3, vec3};
use crate::scene::Environment;

/// Largest weight of a lobe that is looked up in half as many directions.
const WEAK_LOBE: f32 = 0.1;

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
fn widened(alpha: f32, roughness: f32) -> f32 {
    (alpha * alpha + roughness).min(1.0).sqrt()
}

/// Adds k_r times the light of the environment in the lobes of all reflecting points.
pub(crate) fn reflect_environment(frame: &Frame, points: &mut ShadingBatch, stream: SampleStream) {
    let Some(environment) = &frame.environment else { return };
    for i in reflecting_points(points) {
        let reflected = environment_reflection(environment, points, i, stream);
        let (block, lane) = points.soa.lane_mut(i);
        let radiance = vec3(&block.radiance, lane) + reflected;
        set3(&mut block.radiance, lane, radiance.to_array());
    }
}

/// Returns k_r L_r of the environment at point `i`, for the microfacets and the clear coat.
pub(crate) fn environment_reflection(
    environment: &Environment,
    points: &ShadingBatch,
    i: usize,
    stream: SampleStream,
) -> Rgb {
    let layers = &points.coefficients(i).layers;
    let (block, lane) = points.soa.lane(i);
    let roughness = block.roughness[lane];
    let index = stream.samples[points.points[i].sample].index;
    let lobe = |alpha: f32, f0: f32| {
        let alpha = f64::from(widened(alpha, roughness));
        Lobe { n: block.n(lane), v: block.v(lane), alpha, f0: f64::from(f0) }
    };
    let subset = |weight: f32| {
        // Errors of a weak lobe are not seen.
        let directions = if weight < WEAK_LOBE { LOBE_DIRECTIONS / 2 } else { LOBE_DIRECTIONS };
        LobeSubset { index, count: stream.sampler.count, directions }
    };
    let mut radiance = Rgb::ZERO;
    let k_r = vec3(&block.k_r, lane);
    if k_r != Rgb::ZERO {
        let k_r = k_r * layers.occlusion;
        let lobe = lobe(layers.alpha, layers.mean_f0());
        radiance += k_r * lobe.environment_radiance(environment, subset(k_r.max_element()));
    }
    let k_coat = block.k_coat[lane];
    if k_coat > 0.0 {
        let lobe = lobe(layers.coat_alpha, 0.04);
        radiance += k_coat * lobe.environment_radiance(environment, subset(k_coat));
    }
    radiance
}

/// Indices of the points that reflect their surroundings.
fn reflecting_points(points: &mut ShadingBatch) -> Vec<usize> {
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
