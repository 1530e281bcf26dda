//! The last points of paths, where surfaces bounce light no more.

use crate::integrator::area_lighting::block_by_ground;
use crate::integrator::compositor::Compositor;
use crate::integrator::diffuse_rays::{DiffuseBounce, DiffuseDirection};
use crate::integrator::frame::{Frame, distance_beyond};
use crate::integrator::light_beyond::LightBeyond;
use crate::integrator::sample::SampleStream;
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::shadow_rays::ShadowBuffers;
use crate::integrator::surface::soa::{set3, vec3};
use blinn_accel::Coherence;
use blinn_core::geometry::Rgb;

/// Adds the light from beyond the scene to the points at which paths end because they have bounced often enough: one shadow
/// ray each, as lights have there. At all other points, the diffuse rays that pass the scene find it.
pub(crate) fn add_light_beyond_last_bounce(
    frame: &Frame,
    compositor: &Compositor,
    batch: &mut ShadingBatch,
    stream: SampleStream,
    shadow: &mut ShadowBuffers,
) {
    let states = compositor.rays.states;
    let beyond = LightBeyond::new(frame);
    if beyond.is_black() {
        return;
    }
    shadow.traced_rays.clear();
    shadow.traced_rays.coherence = Coherence::None;
    let mut lit: Vec<(usize, Rgb)> = Vec::new();
    for (i, point) in batch.points.iter().enumerate() {
        if states.may_bounce(point.path) || point.is_shadow_catcher {
            continue;
        }
        let Some(bounce) = DiffuseBounce::of_point(compositor, batch, i, stream.wave) else { continue };
        if bounce.ends(stream, point.path) {
            continue;
        }
        let direction = DiffuseDirection::new(batch, i, stream);
        let light = direction.k_d(batch, i)
            * (direction.bump_shadowing / bounce.survival)
            * beyond.radiance(direction.d.as_vec3(), direction.solid_angle);
        if !(light.max_element() > 0.0) {
            continue;
        }
        let (origin, source) = batch.offset_origin(i, direction.d);
        let to = origin.as_dvec3() + direction.d * distance_beyond(origin, frame.posed.bounding_radius());
        shadow.traced_rays.push(origin, to.as_vec3(), source);
        lit.push((i, light));
    }
    if lit.is_empty() {
        return;
    }
    shadow.trace(frame);
    block_by_ground(frame, shadow);
    for ((i, light), visibility) in lit.into_iter().zip(&shadow.visibility) {
        let (block, lane) = batch.soa.lane_mut(i);
        let radiance: Rgb = vec3(&block.radiance, lane);
        set3(&mut block.radiance, lane, (radiance + light * *visibility).to_array());
    }
}
