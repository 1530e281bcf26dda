//! Direct light of the light sources of an environment, from the shadow rays to them.

use crate::integrator::environment_occlusion::{OcclusionEstimate, arriving_light};
use crate::integrator::sample::SampleStream;
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::shadow_rays::ShadowBuffers;
use crate::integrator::surface::bump_shadowing::bump_shadowing;
use crate::integrator::surface::soa::{dvec3, set3, vec3};
use blinn_core::geometry::Rgb;
use blinn_scene::Environment;
use glam::Vec3;

/// Replaces the unshadowed light of the sampled directions, which is the current light of the points, by the light that
/// arrives: the exact light of all sources minus what the shadow rays find hidden and the shadows of bumps. Open surfaces have
/// no noise.
pub(crate) fn apply_source_visibility(
    environment: &Environment,
    batch: &mut ShadingBatch,
    stream: SampleStream,
    shadow: &ShadowBuffers,
    has_shadow_catcher: bool,
) {
    let estimate = |i: usize| {
        let (block, lane) = batch.soa.lane(i);
        let n = block.n(lane).as_vec3();
        let of_sources = if n == Vec3::ZERO { Rgb::ZERO } else { environment.diffuse_of_light_sources(n) };
        let k_d: Rgb = vec3(&block.k.k_d, lane);
        OcclusionEstimate {
            pixel: stream.samples[batch.points[i].path].pixel,
            unoccluded: k_d * of_sources,
            visibility: Rgb::ONE,
            visible: vec3(&block.current_light, lane),
            hidden: Rgb::ZERO,
        }
    };
    let mut estimates: Vec<OcclusionEstimate> = (0..batch.points.len()).map(estimate).collect();
    for (ray, &visibility) in shadow.rays.iter().zip(&shadow.visibility) {
        let estimate = &mut estimates[ray.point];
        let unshadowed = estimate.visible;
        let (block, lane) = batch.soa.lane(ray.point);
        let visibility = visibility * bump_shadowing(block.n(lane), dvec3(&block.n_v, lane), ray.l_centre);
        estimate.visibility = visibility;
        estimate.visible = unshadowed * visibility;
        estimate.hidden = unshadowed * (Rgb::ONE - visibility);
    }
    for (i, light) in arriving_light(&estimates).into_iter().enumerate() {
        let (block, lane) = batch.soa.lane_mut(i);
        if has_shadow_catcher {
            let unshadowed: Rgb = vec3(&block.unshadowed, lane);
            set3(&mut block.unshadowed, lane, (unshadowed + estimates[i].unoccluded).to_array());
        }
        set3(&mut block.current_light, lane, light.to_array());
    }
}
