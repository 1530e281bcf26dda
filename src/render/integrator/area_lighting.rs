//! Direct light of area lights: shadow rays to random points of each light.
//!
//! Where a specular lobe or a matte surface spawns a ray, both the ray and the shadow rays find the light of area lights. The
//! balance heuristic weights them (Veach and Guibas, “Optimally Combining Sampling Techniques for Monte Carlo Rendering”,
//! SIGGRAPH 1995): each by the density with which it samples the direction.

use std::f32::consts::PI;

use glam::Vec3;

use crate::integrator::blinn_phong::blinn_phong;
use crate::integrator::block_lobes::{MIN_IMPORTANCE, survival_probability};
use crate::integrator::compositor::Compositor;
use crate::integrator::diffuse_rays::DiffuseBounce;
use crate::integrator::direct_light::IncidentLight;
use crate::integrator::emitters::Emitters;
use crate::integrator::environment_lighting::apply_source_visibility;
use crate::integrator::frame::Frame;
use crate::integrator::layers::block_layers::{LayerWeights, add_layered_light};
use crate::integrator::layers::layered_point::LobePdf;
use crate::integrator::light_choice::LightChoice;
use crate::integrator::light_points::{LightPoints, SampleAreaLight};
use crate::integrator::material::ggx::{MIRROR_ALPHA, NARROW_ALPHA};
use crate::integrator::material::highlight_lobe::reflection_pdf;
use crate::integrator::microfacet_highlights::{LobeWeights, add_highlights};
use crate::integrator::paths::balance_heuristic;
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::shadow_rays::{ShadowBuffers, apply_specular_visibility, apply_visibility};
use crate::integrator::surface::bump_shadowing::bump_shadowing;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{LANES, ZERO3_F32, dvec3, vec3};
use blinn_accel::Coherence;
use blinn_core::geometry::Rgb;
use blinn_core::simd::AutovecKernel;
use blinn_scene::{Environment, PosedAreaLight};

/// Adds the light of all area lights, glowing surfaces and light sources of the environment to the points of a batch.
pub(crate) fn add_area_lights(
    frame: &Frame,
    compositor: &Compositor,
    batch: &mut ShadingBatch,
    stream: SampleStream,
    terms: LightTerms,
    choice: &LightChoice,
    shadow: &mut ShadowBuffers,
) {
    let sources = Source::all(frame);
    if sources.is_empty() || batch.points.is_empty() {
        return;
    }
    // By block; empty where no secondary rays meet the sources.
    let probabilities: Vec<SpawnProbabilities> = (0..batch.points.len())
        .step_by(LANES)
        .filter(|_| sources.iter().any(Source::is_met_by_rays))
        .map(|first| SpawnProbabilities::new(frame, compositor, batch, first, stream.wave))
        .collect();
    for (index, source) in sources.into_iter().enumerate() {
        shadow.rays.clear();
        shadow.traced_rays.clear();
        shadow.traced_rays.coherence = Coherence::None;
        let dimension = SampleDimension::Light(frame.lights.len() + index);
        // Only at the points of eye rays, whose noise is seen.
        let exact_environment = source.environment().filter(|_| stream.wave == 0);
        let terms = LightTerms {
            has_specular: terms.has_specular && source.is_met_by_rays(),
            has_shadow_catcher: terms.has_shadow_catcher && exact_environment.is_none(),
            ..terms
        };
        let mut incident = IncidentLight::ZERO;
        let mut points = LightPoints::ZERO;
        for first in (0..batch.points.len()).step_by(LANES) {
            let factors = match source {
                Source::Area(_) => choice.of_block(frame.lights.len() + index, first),
                _ => None,
            };
            if factors.is_some_and(|factors| *factors == [0.0; LANES]) {
                batch.soa.lane_mut(first).0.clear_current_light();
                continue;
            }
            source.sample(frame, batch, stream, dimension, first, &mut points);
            let (block, _) = batch.soa.lane_mut(first);
            frame.simd().run(AddLightPoints {
                block,
                points: &points,
                spawn: match probabilities.get(first / LANES) {
                    Some(spawn) if source.is_met_by_rays() => spawn,
                    _ => &SpawnProbabilities::NONE,
                },
                terms,
                factors,
                without_bumps: exact_environment.is_some(),
                incident: &mut incident,
            });
            push_shadow_rays(batch, first, &incident, &points, shadow);
        }
        if terms.has_shadows {
            shadow.trace(frame);
            block_by_ground(frame, shadow);
        } else {
            shadow.rays.clear();
        }
        match exact_environment {
            Some(environment) => {
                apply_source_visibility(environment, batch, stream, shadow, frame.has_shadow_catcher());
            }
            None => apply_visibility(batch, shadow),
        }
        if terms.separates_specular() && terms.has_specular {
            apply_specular_visibility(batch, shadow);
        }
        if terms.is_split {
            batch.soa.accumulate_noisy();
        }
        batch.soa.accumulate(frame.simd());
        if terms.has_layers {
            batch.assign_direct_light();
        }
    }
}

/// A light source with an extent, of which shadow rays sample points.
#[derive(Clone, Copy)]
enum Source<'a> {
    Area(&'a PosedAreaLight),
    Emitters(&'a Emitters),
    /// The light sources of an environment. Diffuse rays that escape find the rest of it, and specular lobes all of it.
    Environment(&'a Environment),
}

impl<'a> Source<'a> {
    fn all(frame: &'a Frame) -> Vec<Source<'a>> {
        let area_lights = frame.area_lights.iter().map(Source::Area);
        let emitters = frame.emitters.as_deref().map(Source::Emitters);
        let environment = frame.environment_sources().map(Source::Environment);
        area_lights.chain(emitters).chain(environment).collect()
    }

    /// True if secondary rays find the light of the source as well.
    fn is_met_by_rays(&self) -> bool {
        !matches!(self, Source::Environment(_))
    }

    /// Samples a point of the source for each point of a block.
    fn sample(
        &self,
        frame: &Frame,
        batch: &ShadingBatch,
        stream: SampleStream,
        dimension: SampleDimension,
        first: usize,
        points: &mut LightPoints,
    ) {
        let count = LANES.min(batch.points.len() - first);
        let u = points_of_block(frame, batch, stream, dimension, first, count);
        let (block, _) = batch.soa.lane(first);
        match *self {
            Source::Area(light) => frame.simd().run(SampleAreaLight { light, u: &u, points }),
            Source::Emitters(emitters) => {
                let choice = SampleDimension::EmitterChoice;
                let choice = points_of_block(frame, batch, stream, choice, first, count)[0];
                points.sample_emitters(frame.posed, emitters, block, count, &choice, &u);
            }
            Source::Environment(environment) => {
                points.sample_environment(frame.posed, environment, block, count, &u);
            }
        }
    }

    fn environment(&self) -> Option<&'a Environment> {
        match self {
            Source::Environment(environment) => Some(environment),
            _ => None,
        }
    }
}

/// The terms of the shading model that count.
#[derive(Clone, Copy)]
pub(crate) struct LightTerms {
    pub has_specular: bool,
    pub has_shadows: bool,
    /// True if the light without shadows is summed as well.
    pub has_shadow_catcher: bool,
    /// True if noisy light is split from the rest.
    pub is_split: bool,
    /// True if light is split by layer.
    pub has_layers: bool,
}

impl LightTerms {
    /// True if the specular part of each source's light is wanted.
    fn separates_specular(&self) -> bool {
        self.is_split || self.has_layers
    }
}

/// The points of the unit square that become the points of a light that the points of a block see.
fn points_of_block(
    frame: &Frame,
    batch: &ShadingBatch,
    stream: SampleStream,
    dimension: SampleDimension,
    first: usize,
    count: usize,
) -> [[f32; LANES]; 2] {
    let path = |i: usize| batch.points[first + i].path;
    let mut positions = [None; LANES];
    for (i, position) in positions.iter_mut().enumerate().take(count) {
        *position = stream.sequence_position(path(i), 1);
    }
    stream.points_of_lanes(frame.simd(), dimension, &positions, count, |i| stream.get_2d(path(i), dimension))
}

/// Adds the shadow rays from the points of a block that face the points of a light source.
fn push_shadow_rays(
    batch: &ShadingBatch,
    first: usize,
    incident: &IncidentLight,
    points: &LightPoints,
    shadow: &mut ShadowBuffers,
) {
    let count = LANES.min(batch.points.len() - first);
    let from = shadow.rays.len();
    incident.push_shadow_rays(first, incident.lit_mask(count), &mut shadow.rays);
    for ray in &shadow.rays[from..] {
        let source = batch.excluded_triangle(ray.point, ray.light_in_front);
        shadow.traced_rays.push(ray.origin, vec3(&points.p, ray.point % LANES), source);
    }
}

/// Hides lights behind an opaque ground.
pub(crate) fn block_by_ground(frame: &Frame, shadow: &mut ShadowBuffers) {
    if frame.opaque_ground_height().is_none() {
        return;
    }
    let rays = &shadow.traced_rays;
    for ((from, to), visibility) in rays.from.iter().zip(&rays.to).zip(&mut shadow.visibility) {
        if frame.ground_blocks(*from, to.as_dvec3() - from.as_dvec3(), false) {
            *visibility = Rgb::ZERO;
        }
    }
}

/// The probabilities with which the lobes of a block of points spawn rays; 0 for a lobe that is not there.
struct SpawnProbabilities {
    diffuse: [f32; LANES],
    facets: [f32; LANES],
    coats: [f32; LANES],
}

impl SpawnProbabilities {
    const NONE: SpawnProbabilities =
        SpawnProbabilities { diffuse: [0.0; LANES], facets: [0.0; LANES], coats: [0.0; LANES] };

    fn new(
        frame: &Frame,
        compositor: &Compositor,
        batch: &ShadingBatch,
        first: usize,
        wave: u32,
    ) -> SpawnProbabilities {
        let mut probabilities = SpawnProbabilities::NONE;
        let states = compositor.rays.states;
        for i in first..batch.points.len().min(first + LANES) {
            let (block, lane) = batch.soa.lane(i);
            let path = batch.points[i].path;
            if let Some(bounce) = DiffuseBounce::new(compositor, batch, i, wave) {
                probabilities.diffuse[lane] = bounce.survival;
            }
            if !block.reflects(lane) || !states.may_reflect(path) {
                continue;
            }
            let throughput = compositor.throughput(batch, i) * states.importance(path);
            if throughput.max_element() < MIN_IMPORTANCE
                || frame.refracts(batch.points[i].id, &batch.coefficients(i))
            {
                continue;
            }
            let probability = |k_r: Rgb, alpha: f32| {
                let importance = (throughput * k_r).max_element();
                survival_probability(importance, alpha <= NARROW_ALPHA, wave, frame.occludes_environment())
            };
            let layers = block.k.layers.get(lane);
            probabilities.facets[lane] = probability(vec3(&block.k_r, lane), layers.alpha);
            probabilities.coats[lane] = probability(Rgb::splat(block.k_r_coat[lane]), layers.coat_alpha);
        }
        probabilities
    }
}

/// Computes the unshadowed light of the points of a light source at a block of points.
struct AddLightPoints<'a> {
    block: &'a mut PointBlock,
    points: &'a LightPoints,
    spawn: &'a SpawnProbabilities,
    terms: LightTerms,
    /// Factors of the light; 1 if there are none.
    factors: Option<&'a [f32; LANES]>,
    /// Leaves out the shadows of bumps, also from below the surface, which are applied with visibility.
    without_bumps: bool,
    incident: &'a mut IncidentLight,
}

impl AutovecKernel for AddLightPoints<'_> {
    #[inline(always)]
    fn run(self) {
        let AddLightPoints { block, points, spawn, terms, factors, without_bumps, incident } = self;
        let mut density = [0.0; LANES];
        for i in 0..LANES {
            let p: Vec3 = vec3(&block.p, i);
            let to: Vec3 = vec3(&points.p, i);
            let offset = to.as_dvec3() - p.as_dvec3();
            let r2 = offset.length_squared();
            let l = offset * (1.0 / r2.sqrt());
            let normal: Vec3 = vec3(&points.normal, i);
            let cos = (-l.dot(normal.as_dvec3())) as f32;
            // E/π of the sampled point: L cos A / (π r²).
            let solid_angle = points.area[i] * cos / r2 as f32;
            let is_lit = cos > 0.0 && solid_angle < f32::INFINITY;
            density[i] = 1.0 / solid_angle;
            let irradiance: Rgb = vec3(&points.radiance, i) * (solid_angle * (1.0 / PI));
            let irradiance = if is_lit { irradiance } else { Rgb::ZERO };
            incident.set_if(without_bumps || dvec3(&block.n_v, i).dot(l) > 0.0, block, i, l, irradiance);
        }
        if let Some(factors) = factors {
            incident.scale(factors);
        }
        let lit = incident.lit_mask(LANES) != 0;
        let mut diffuse_weight = [1.0; LANES];
        for i in 0..LANES {
            let of_ray = DiffuseBounce::density(spawn.diffuse[i], incident.n_dot_l[i]);
            let of_ray = if incident.n_g_dot_l[i] > 0.0 { of_ray } else { 0.0 };
            let weight = balance_heuristic(density[i], of_ray);
            // NaN where the light faces away.
            let weight = if weight >= 0.0 { weight } else { 1.0 };
            let bumps = bump_shadowing(block.n(i), dvec3(&block.n_v, i), incident.l(i));
            diffuse_weight[i] = if without_bumps { weight } else { weight * bumps };
        }
        blinn_phong(block, incident, terms.has_specular && block.has_specular && lit, &diffuse_weight);
        let diffuse = if terms.separates_specular() { block.current_light } else { ZERO3_F32 };
        if lit && block.layered.mask() != 0 {
            add_layered_light(block, incident, true, &|i, pdfs| {
                let weight = |probability: f32, LobePdf { density: of_lobe, alpha }: LobePdf| {
                    light_weight(density[i], probability, alpha, probability * of_lobe)
                };
                if !terms.has_specular {
                    return LayerWeights::diffuse(diffuse_weight[i]);
                }
                LayerWeights {
                    facets: weight(spawn.facets[i], pdfs.facets),
                    coat: weight(spawn.coats[i], pdfs.coat),
                    diffuse: diffuse_weight[i],
                }
            });
        }
        if terms.has_specular && lit && block.highlights.points != 0 {
            let mut weights = LobeWeights { has_exact_fresnel: true, ..LobeWeights::ONE };
            for i in 0..LANES {
                let (n, v, l) =
                    (block.n_specular(i).as_vec3(), block.v(i).as_vec3(), incident.l(i).as_vec3());
                let weight = |probability: f32, alpha: f32| {
                    let of_ray = probability * reflection_pdf(n, l, v, alpha * alpha);
                    light_weight(density[i], probability, alpha, of_ray)
                };
                weights.facets[i] = weight(spawn.facets[i], block.lobe_alpha[i]);
                weights.coats[i] = weight(spawn.coats[i], block.coat_alpha[i]);
            }
            add_highlights(block, incident, &weights);
        }
        if terms.separates_specular() {
            block.current_specular = diffuse;
            block.leave_specular_light();
        }
        if terms.has_shadow_catcher {
            block.accumulate_unshadowed();
        }
    }
}

/// The weight of the light that a shadow ray finds in a lobe that spawns a ray with a probability. `density` is that of the
/// shadow ray's direction, per steradian, and `of_ray` that of the ray.
#[inline(always)]
fn light_weight(density: f32, probability: f32, alpha: f32, of_ray: f32) -> f32 {
    let weight = balance_heuristic(density, of_ray);
    // The image in a mirror has no noise.
    let weight = if alpha < MIRROR_ALPHA as f32 { 0.0 } else { weight };
    // NaN where the lane holds no lobe.
    if probability > 0.0 && weight >= 0.0 { weight } else { 1.0 }
}
