//! The rays that matte surfaces spawn: bounced light, in place of the ambient term.
//!
//! Directions have the density of the cosine, so that a ray's weight is k_d. Paths end by Russian roulette, in proportion
//! to their importance, and after [`Frame::indirect`] bounces.

use crate::integrator::block_lobes::MIN_IMPORTANCE;
use crate::integrator::compositor::Compositor;
use crate::integrator::environment_occlusion::LOOKUP_SHARE;
use crate::integrator::frame::Frame;
use crate::integrator::layers::block_layers::point_lobes;
use crate::integrator::lobe_samples::mirrored_to_side;
use crate::integrator::paths::{AreaLightHits, Escape, PathState, SecondaryRay, Wave};
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::bump_shadowing::bump_shadowing;
use crate::integrator::surface::soa::{dvec3, vec3};
use blinn_core::geometry::{Rgb, cosine_hemisphere};
use glam::Vec3;

/// Russian roulette: paths of less importance go on with a probability in proportion to it.
const ROULETTE_IMPORTANCE: f32 = 0.5;

/// The light that a diffuse ray carries, and the probability with which it is spawned.
#[derive(Clone, Copy)]
pub(crate) struct DiffuseBounce {
    /// Share of the light along the ray that arrives at the origin of the path's ray.
    arrives: Rgb,
    /// The brightest channel of `arrives`, times the importance of the path.
    importance: f32,
    pub survival: f32,
}

impl DiffuseBounce {
    /// The diffuse ray of point `i` of a batch; `None` where the path ends.
    pub fn new(compositor: &Compositor, batch: &ShadingBatch, i: usize, wave: u32) -> Option<DiffuseBounce> {
        let point = &batch.points[i];
        let states = compositor.rays.states;
        if !states.may_bounce(point.path) || point.is_shadow_catcher {
            return None;
        }
        let (block, lane) = batch.soa.lane(i);
        let k_d: Rgb = vec3(&block.k.k_d, lane);
        // The mean weight of rays, whose layers reflect some directions more than others.
        let k_d = block.layered.get(lane).map_or(k_d, |point| k_d + point.k_a);
        let arrives = compositor.throughput(batch, i) * k_d;
        let importance = states.importance(point.path) * arrives.max_element();
        let survival = if wave == 0 { 1.0 } else { (importance / ROULETTE_IMPORTANCE).min(1.0) };
        (importance >= MIN_IMPORTANCE).then_some(DiffuseBounce { arrives, importance, survival })
    }

    /// Density per steradian with which the ray goes in a direction at cosine `cos` to the shading normal.
    #[inline(always)]
    pub fn density(survival: f32, cos: f32) -> f32 {
        survival * cos.max(0.0) * std::f32::consts::FRAC_1_PI
    }
}

/// Spawns one diffuse ray of each point of the batch whose path goes on, before the batch is composited.
pub(crate) fn spawn_diffuse_rays(
    frame: &Frame,
    compositor: &Compositor,
    batch: &ShadingBatch,
    stream: SampleStream,
    wave: &mut Wave,
) {
    let states = compositor.rays.states;
    let environment = frame.ambient_environment();
    let beyond = |d: Vec3, solid_angle: f32| match &environment {
        Some(environment) => environment.radiance(d, solid_angle),
        None => frame.ambient_radiance(),
    };
    for (i, point) in batch.points.iter().enumerate() {
        let Some(bounce) = DiffuseBounce::new(compositor, batch, i, stream.wave) else { continue };
        let Some(state) = states.get(point.path) else { continue };
        let DiffuseBounce { arrives, importance, survival } = bounce;
        let (block, lane) = batch.soa.lane(i);
        if survival < 1.0 && stream.get_2d(point.path, SampleDimension::DiffuseRoulette)[0] >= survival {
            continue;
        }
        let n = block.n(lane);
        let l = cosine_hemisphere(n, stream.get_2d(point.path, SampleDimension::Diffuse));
        let n_g = dvec3(&block.n_g, lane);
        let bump_shadowing = bump_shadowing(n, dvec3(&block.n_v, lane), l);
        let area_lights = if l.dot(n_g) < 0.0 {
            // Shadow rays find all light behind the triangle, and mirrored rays are none of theirs.
            AreaLightHits::Ignored
        } else {
            AreaLightHits::Weighted(DiffuseBounce::density(survival, n.dot(l) as f32))
        };
        let direction = mirrored_to_side(l, n_g);
        let solid_angle = lookup_solid_angle(n.dot(l), stream.sampler.count);
        let mean_arrives = arrives / survival;
        let cos = n.dot(l).max(1e-6) as f32;
        let arrives = match point_lobes(block, lane) {
            Some(lobes) => {
                let k_d = vec3(&block.k.k_d, lane) + lobes.reflect_diffuse(l.as_vec3()) / cos;
                compositor.throughput(batch, i) * k_d / survival
            }
            None => mean_arrives,
        };
        let unoccluded = environment
            .as_ref()
            .filter(|_| stream.wave == 0)
            .map(|environment| mean_arrives * environment.diffuse(n.as_vec3()));
        let (origin, source) = batch.offset_origin(i, direction);
        let mut media = state.media;
        if batch.is_back && frame.is_body(point.id) {
            media = frame.cross(&media, point.id, frame.is_front(point.id, -n_g), state.wavelength).behind;
        }
        let state = PathState {
            origin,
            width: state.width_at(vec3(&block.p, lane)),
            spread: solid_angle.sqrt(),
            importance: importance / survival,
            media,
            diffuse_left: state.diffuse_left - 1,
            is_indirect: true,
            ..state
        };
        let ray = SecondaryRay {
            parent: point.path,
            weight: arrives * bump_shadowing,
            escape_weight: arrives,
            bump_shadowing,
            max_light: f32::INFINITY,
            escape: Escape::Radiance(beyond(direction.as_vec3(), solid_angle)),
            unoccluded,
            direction: direction.as_vec3(),
            source,
            is_diffuse: true,
            is_rough: false,
            seen_share: 0.0,
            area_lights,
            state,
        };
        wave.push(ray, stream.samples[point.path]);
    }
}

/// The solid angle over which a ray looks up the environment: a share of what it stands for, in steradians.
fn lookup_solid_angle(cos: f64, count: u32) -> f32 {
    let density = cos.max(1e-6) / std::f64::consts::PI;
    (LOOKUP_SHARE / (f64::from(count.max(1)) * density)).min(2.0 * std::f64::consts::PI) as f32
}
