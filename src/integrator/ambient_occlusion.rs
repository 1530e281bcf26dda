//! Ambient occlusion: the share of light from all directions that reaches a point.

use crate::accel::Coherence;
use crate::geometry::{Rgb, cosine_hemisphere};
use crate::integrator::frame::{AmbientOcclusion, Frame};
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::shadow_rays::ShadowBuffers;
use crate::integrator::surface::soa::{dvec3, set3};

/// Sets the radiance of the points to k_e + V k_a I_a, where V is the share of ambient light that arrives.
pub(crate) fn occlude_ambient(
    frame: &Frame,
    settings: AmbientOcclusion,
    points: &mut ShadingBatch,
    stream: SampleStream,
    buffers: &mut ShadowBuffers,
) {
    let has_ambient = |&i: &usize| {
        let (_, k_a) = points.emission_and_ambient(i);
        points.coefficients(i).alpha > 0.0 && k_a * frame.ambient_at(points.n(i)) != Rgb::ZERO
    };
    let indices: Vec<usize> = (0..points.points.len()).filter(has_ambient).collect();
    let visibility = trace_ambient_visibility(frame, settings, points, &indices, stream, buffers);
    for (i, visibility) in indices.into_iter().zip(visibility) {
        let (k_e, k_a) = points.emission_and_ambient(i);
        let radiance = k_e + k_a * frame.ambient_at(points.n(i)) * visibility;
        let (block, lane) = points.soa.lane_mut(i);
        set3(&mut block.radiance, lane, radiance.to_array());
    }
}

/// The visibility of the hemisphere at the points of those indices, by colour: the mean over directions whose density is
/// the cosine to the shading normal.
fn trace_ambient_visibility(
    frame: &Frame,
    settings: AmbientOcclusion,
    points: &ShadingBatch,
    indices: &[usize],
    stream: SampleStream,
    buffers: &mut ShadowBuffers,
) -> Vec<Rgb> {
    // What reflections and glass show is one surface among others in a pixel: one ray for each sample suffices.
    let samples = if stream.wave == 0 { settings.samples } else { 1 };
    let parts = samples.div_ceil(stream.sampler.count.max(1)).max(1);
    let mut sums = vec![Rgb::ZERO; indices.len()];
    for part in 0..parts {
        let segments = &mut buffers.segments;
        segments.clear();
        segments.coherence = Coherence::None;
        for &i in indices {
            let (block, lane) = points.soa.lane(i);
            let n_g = dvec3(&block.n_g, lane);
            let sample = points.points[i].sample;
            let u = stream.get_2d_split(sample, SampleDimension::Ambient, part, parts);
            let l = cosine_hemisphere(block.n(lane), u);
            // Directions into the triangle, which a tilted shading normal allows, are mirrored out.
            let l = l - n_g * (2.0 * l.dot(n_g).min(0.0));
            let (from, source) = points.shadow_ray_origin(i, l);
            let distance = settings.distance.min(frame.distance_beyond_scene(from));
            segments.push(from, (from.as_dvec3() + l * distance).as_vec3(), source);
        }
        buffers.trace(frame);
        for (k, sum) in sums.iter_mut().enumerate() {
            let from = buffers.segments.from[k];
            let to = buffers.segments.to[k];
            let to_infinity = settings.distance == f64::INFINITY;
            if !frame.ground_blocks(from, to.as_dvec3() - from.as_dvec3(), to_infinity) {
                *sum += buffers.visibility[k];
            }
        }
    }
    sums.iter().map(|&sum| sum / parts as f32).collect()
}
