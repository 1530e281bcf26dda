//! The rays that matte surfaces spawn: bounced light, in place of the ambient term.
//!
//! Directions have the density of the cosine, so that a ray's weight is k_d. Paths end by Russian roulette, in proportion
//! to their importance, and after [`Frame::indirect`] bounces.

use crate::integrator::block_lobes::MIN_IMPORTANCE;
use crate::integrator::compositor::Compositor;
use crate::integrator::environment_occlusion::LOOKUP_SHARE;
use crate::integrator::frame::Frame;
use crate::integrator::layers::block_layers::point_lobes;
use crate::integrator::light_beyond::LightBeyond;
use crate::integrator::lobe_samples::mirrored_to_side;
use crate::integrator::paths::{AreaLightHits, Escape, PathState, SecondaryRay, Wave};
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::bump_shadowing::bump_shadowing;
use crate::integrator::surface::soa::{dvec3, vec3};
use blinn_core::geometry::{Rgb, cosine_hemisphere};
use glam::DVec3;

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
        let may_bounce = compositor.rays.states.may_bounce(point.path) && !point.is_shadow_catcher;
        may_bounce.then(|| DiffuseBounce::of_point(compositor, batch, i, wave)).flatten()
    }

    /// The same, however many bounces the path has left.
    pub fn of_point(
        compositor: &Compositor,
        batch: &ShadingBatch,
        i: usize,
        wave: u32,
    ) -> Option<DiffuseBounce> {
        let point = &batch.points[i];
        let states = compositor.rays.states;
        let (block, lane) = batch.soa.lane(i);
        let k_d: Rgb = vec3(&block.k.k_d, lane);
        // The mean weight of rays, whose layers reflect some directions more than others.
        let k_d = block.layered.get(lane).map_or(k_d, |point| k_d + point.k_a);
        let arrives = compositor.throughput(batch, i) * k_d;
        let importance = states.importance(point.path) * arrives.max_element();
        let survival = if wave == 0 { 1.0 } else { (importance / ROULETTE_IMPORTANCE).min(1.0) };
        (importance >= MIN_IMPORTANCE).then_some(DiffuseBounce { arrives, importance, survival })
    }

    /// Returns true if Russian roulette ends the path.
    pub fn ends(&self, stream: SampleStream, path: usize) -> bool {
        self.survival < 1.0 && stream.get_2d(path, SampleDimension::DiffuseRoulette)[0] >= self.survival
    }

    /// Density per steradian with which the ray goes in a direction at cosine `cos` to the shading normal.
    #[inline(always)]
    pub fn density(survival: f32, cos: f32) -> f32 {
        survival * cos.max(0.0) * std::f32::consts::FRAC_1_PI
    }
}

/// A random direction from which a matte surface receives light.
pub(crate) struct DiffuseDirection {
    /// The direction above the smooth surface whose density is the cosine to the shading normal. It may be below the triangle.
    l: DVec3,
    /// Unit direction of the ray: `l`, mirrored to the side of the triangle.
    pub d: DVec3,
    /// n·l, at least a little.
    cos: f32,
    pub bump_shadowing: f32,
    /// The solid angle over which the ray looks up the environment, in steradians.
    pub solid_angle: f32,
}

impl DiffuseDirection {
    /// The direction of point `i` of a batch.
    pub fn new(batch: &ShadingBatch, i: usize, stream: SampleStream) -> DiffuseDirection {
        let (block, lane) = batch.soa.lane(i);
        let n = block.n(lane);
        let l = cosine_hemisphere(n, stream.get_2d(batch.points[i].path, SampleDimension::Diffuse));
        DiffuseDirection {
            l,
            d: mirrored_to_side(l, dvec3(&block.n_g, lane)),
            cos: n.dot(l).max(1e-6) as f32,
            bump_shadowing: bump_shadowing(n, dvec3(&block.n_v, lane), l),
            solid_angle: lookup_solid_angle(n.dot(l), stream.sampler.count),
        }
    }

    /// k_d of light from this direction; layers reflect some directions more than others.
    pub fn k_d(&self, batch: &ShadingBatch, i: usize) -> Rgb {
        let (block, lane) = batch.soa.lane(i);
        let k_d = vec3(&block.k.k_d, lane);
        let lobes = point_lobes(block, lane);
        lobes.map_or(k_d, |lobes| k_d + lobes.reflect_diffuse(self.l.as_vec3()) / self.cos)
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
    let beyond = LightBeyond::new(frame);
    for (i, point) in batch.points.iter().enumerate() {
        let Some(bounce) = DiffuseBounce::new(compositor, batch, i, stream.wave) else { continue };
        let Some(state) = states.get(point.path) else { continue };
        if bounce.ends(stream, point.path) {
            continue;
        }
        let DiffuseBounce { arrives: mean_arrives, importance, survival } = bounce;
        let (block, lane) = batch.soa.lane(i);
        let (n, n_g) = (block.n(lane), dvec3(&block.n_g, lane));
        let direction = DiffuseDirection::new(batch, i, stream);
        let DiffuseDirection { l, d, bump_shadowing, solid_angle, .. } = direction;
        let area_lights = if l.dot(n_g) < 0.0 {
            // Shadow rays find all light behind the triangle, and mirrored rays are none of theirs.
            AreaLightHits::Ignored
        } else {
            AreaLightHits::Weighted(DiffuseBounce::density(survival, n.dot(l) as f32))
        };
        let arrives = compositor.throughput(batch, i) * direction.k_d(batch, i) / survival;
        let unoccluded = beyond
            .environment
            .as_ref()
            .filter(|_| stream.wave == 0)
            .map(|environment| mean_arrives / survival * environment.diffuse(n.as_vec3()));
        let (origin, source) = batch.offset_origin(i, d);
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
            escape: Escape::Radiance(beyond.radiance(d.as_vec3(), solid_angle)),
            unoccluded,
            direction: d.as_vec3(),
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
