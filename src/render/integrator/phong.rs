//! Blinn-Phong shading: the last slide of the lecture, extended by emission k_e, visibility V and reflection k_r L_r.
//!
//! L = k_e + k_a I_a + Σ V · I/r² · [ k_d max(0, n·l) + k_s max(0, n·h)^p ] + k_r L_r,  h = (v + l)/‖v + l‖
//!
//! The sum is over the lights. V, 0…1, is the visibility of the light, which a shadow ray finds. L_r is the light that
//! arrives from where the surface reflects; k_r is 0 for matte surfaces. Physical materials that reflect have k_s = 0, and
//! [`add_layers`] reflects lights in the lobe of L_r instead, and in those of all other layers. The lecture's exponent p is `shininess` here, and its ray
//! origin p is `o`: in this program p is a point of a surface.
//!
//! Points are shaded in blocks of [`LANES`], stored as structure of arrays, so that the loops over a block are vectorised.
//! The path of a pixel:
//!
//! 1. `render::tiles` cuts the film into tiles and `render::sample_generator` places samples in their pixels.
//!    [`Phong::render`] gets the samples of many pixels at once.
//! 2. [`PathRays`] makes an eye ray of each, with `Camera::eye_ray`, and finds the closest hits, with `Accel::intersect`.
//! 3. [`gather_points`] computes surface and material of each hit (`surface/`, `material/`), and fills blocks of points
//!    with n, k_d, k_s, p and the radiance k_e + k_a I_a.
//! 4. [`Phong::shade`] computes v and k_r, and adds the light of each source: [`DirectLightKernel`] evaluates the formula with [`blinn_phong`],
//!    [`trace_visibility`] traces the shadow rays, with `Accel::occluded`. Paper has [`BackSides`] that are lit in the same way.
//! 5. [`spawn_rays`] lists the rays that reflecting and refracting points spawn, and adds the environment's light where no
//!    ray is needed.
//! 6. [`Compositor`] adds the points' light to their paths. Rays continue behind transparent surfaces: back to step 2.
//! 7. [`Phong::trace`] traces the rays of step 5 in the same way, as the next
//!    [`Wave`](crate::integrator::paths::Wave), and adds what they find.
//! 8. `render::tiles` averages the samples of a pixel, and `render::film` collects the tiles.

use glam::DVec3;

use crate::integrator::Integrator;
use crate::integrator::ambient_occlusion::occlude_ambient;
use crate::integrator::area_lighting::{LightTerms, add_area_lights};
use crate::integrator::back_sides::BackSides;
use crate::integrator::blinn_phong::blinn_phong;
use crate::integrator::caustics::remove_specular_lobes;
use crate::integrator::compositor::Compositor;
use crate::integrator::diffuse_rays::spawn_diffuse_rays;
use crate::integrator::direct_light::IncidentLight;
use crate::integrator::frame::Frame;
use crate::integrator::gather::gather_points;
use crate::integrator::highlight_limits::limit_highlights;
use crate::integrator::last_bounce::add_light_beyond_last_bounce;
use crate::integrator::layer_split::apply_specular_layers;
use crate::integrator::layers::block_layers::add_layers;
use crate::integrator::light_choice::LightChoice;
use crate::integrator::light_layers::{LightLayer, SampleLayers};
use crate::integrator::light_parts::{LightSplit, SampleParts};
use crate::integrator::material::coefficients::BaseTerms;
use crate::integrator::path_rays::{MAX_SURFACES_PER_RAY, PathRays};
use crate::integrator::paths::{PathLight, PathStates, Wave};
use crate::integrator::sample::{Sample, SampleStream};
use crate::integrator::sampler::LowDiscrepancySampler;
use crate::integrator::scratch::{Scratch, WaveBuffers};
use crate::integrator::secondary_rays::spawn_rays;
use crate::integrator::shading_batch::{BatchBuffers, ShadingBatch};
use crate::integrator::shadow_rays::{
    ShadowBuffers, ShadowRay, apply_specular_visibility, apply_visibility, trace_visibility,
};
use crate::integrator::surface::points_soa::PointsSoa;
use crate::integrator::surface::soa::LANES;
use crate::integrator::transmitted_highlights::add_transmitted_highlights;
use blinn_core::geometry::{Rgb, Rgba};
use blinn_core::simd::AutovecKernel;
use blinn_scene::PosedLight;

/// The lecture's stages of shading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub enum Stage {
    /// The surface's colour, or the background.
    Color,
    /// Lambertian shading.
    Diffuse,
    /// Lambertian shading with shadows.
    Shadow,
    /// All terms: emission, ambient, diffuse, specular, with shadows.
    #[default]
    Phong,
}

/// A Whitted-style ray tracer with Blinn-Phong shading.
#[derive(Clone, Copy, Debug, Default)]
pub struct Phong {
    /// The terms that count.
    pub stage: Stage,
}

impl Integrator for Phong {
    fn render(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        out: &mut [Rgba],
    ) {
        let light = self.trace_samples(frame, samples, sampler, scratch, None, false).into_light();
        for ((out, sample), light) in out.iter_mut().zip(samples).zip(light) {
            *out = color(frame, sample, light);
        }
    }

    fn render_parts(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        split: LightSplit,
        out: &mut [SampleParts],
    ) {
        let traced = self.trace_samples(frame, samples, sampler, scratch, Some(split), false);
        let (light, parts) = traced.into_parts();
        for (((out, sample), light), parts) in out.iter_mut().zip(samples).zip(light).zip(parts) {
            let exact = color(frame, sample, light) - parts.noisy.sum().extend(0.0);
            *out = SampleParts { exact, ..parts };
        }
    }

    fn render_layers(
        &self,
        frame: &Frame,
        samples: &[Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &mut Scratch,
        split: Option<LightSplit>,
        out: &mut [SampleLayers],
    ) {
        let traced = self.trace_samples(frame, samples, sampler, scratch, split, true);
        for ((out, sample), light) in out.iter_mut().zip(samples).zip(traced.into_layers()) {
            let (light, layers) = light;
            *out = layers;
            if let Some(background) = frame.background_radiance(sample) {
                out.layers[LightLayer::Environment] += light.transmittance * background;
            }
        }
    }

    fn may_hit(&self, frame: &Frame, low: [f64; 2], high: [f64; 2]) -> bool {
        frame.may_hit(low, high)
    }
}

/// The colour of a sample, with the background behind its path.
fn color(frame: &Frame, sample: &Sample, light: PathLight) -> Rgba {
    let PathLight { radiance, transmittance, .. } = light;
    match frame.background_radiance(sample) {
        Some(background) => (radiance + transmittance * background).extend(1.0),
        // Alpha is the mean opacity of the three colours.
        None => radiance.extend(1.0 - transmittance.element_sum() / 3.0),
    }
}

impl Phong {
    /// The light of the eye rays of `samples`, perhaps split into parts, and by layer if `has_layers`.
    fn trace_samples<'s>(
        &self,
        frame: &'s Frame,
        samples: &'s [Sample],
        sampler: &LowDiscrepancySampler,
        scratch: &'s mut Scratch,
        split: Option<LightSplit>,
        has_layers: bool,
    ) -> Compositor<'s> {
        let Scratch { rays, hits, points, shadow, waves } = scratch;
        let stream = SampleStream { samples, sampler, wave: 0 };
        let mut eye_rays = PathRays::new(frame, samples, rays, hits);
        let reflects = self.reflections_enabled(frame) && frame.posed.has_reflecting_materials;
        if reflects || self.traces_indirect(frame) {
            eye_rays.states = PathStates::Eye(frame, samples);
        }
        let mut compositor = Compositor::new(frame, eye_rays);
        if let Some(split) = split {
            compositor.split(split);
        }
        if has_layers {
            compositor.collect_layers();
        }
        self.trace(frame, &mut compositor, stream, points, shadow, waves);
        compositor
    }

    /// True if surfaces reflect and refract their surroundings.
    fn reflections_enabled(&self, frame: &Frame) -> bool {
        self.stage == Stage::Phong && frame.reflections_enabled()
    }

    /// True if light that bounces between matte surfaces is traced.
    fn traces_indirect(&self, frame: &Frame) -> bool {
        self.stage == Stage::Phong && frame.indirect > 0
    }

    /// L along a wave of rays: eye rays at first, then the rays that surfaces have reflected or refracted.
    ///
    /// Each turn of the loop shades one surface of every path, because the ground has nothing behind it. Rays are therefore
    /// spawned with the transmittance in front of the batch, before it is composited.
    fn trace(
        &self,
        frame: &Frame,
        compositor: &mut Compositor,
        stream: SampleStream,
        buffers: &mut BatchBuffers,
        shadow: &mut ShadowBuffers,
        waves: &mut Vec<WaveBuffers>,
    ) {
        let mut next = waves.pop().unwrap_or_default();
        next.wave.clear();
        for _ in 0..MAX_SURFACES_PER_RAY {
            compositor.rays.intersect(frame);
            compositor.add_area_light_hits();
            let base_radiance = |k: BaseTerms, n: DVec3| self.base_radiance(frame, k, n);
            let reflections_enabled = self.reflections_enabled(frame);
            let mut batch =
                gather_points(frame, compositor, stream.samples, buffers, reflections_enabled, base_radiance);
            self.shade(frame, compositor, &mut batch, stream, shadow);
            let mut back = BackSides::of(frame, &batch, base_radiance);
            if let Some(back) = &mut back {
                self.shade(frame, compositor, &mut back.batch, stream, shadow);
                back.add_to(&mut batch);
            }
            if reflections_enabled {
                add_transmitted_highlights(frame, compositor, &mut batch, stream, shadow);
            }
            batch.assign_light_to(LightLayer::SpecularDirect);
            let (spawned, unseen) = (next.wave.rays.len(), next.wave.unseen.len());
            spawn_rays(frame, compositor, &mut batch, stream, &mut next.wave);
            batch.assign_light_to(LightLayer::SpecularIndirect);
            if self.traces_indirect(frame) {
                for batch in std::iter::once(&batch).chain(back.as_ref().map(|back| &back.batch)) {
                    spawn_diffuse_rays(frame, compositor, batch, stream, &mut next.wave);
                }
            }
            let Wave { rays, unseen: left_out, .. } = &next.wave;
            let continues = compositor.composite(frame, &batch, &rays[spawned..], &left_out[unseen..]);
            batch.recycle(buffers);
            if !continues {
                break;
            }
        }
        let WaveBuffers { wave, rays, hits } = &mut next;
        if !wave.rays.is_empty() {
            let stream = SampleStream { samples: &wave.samples, wave: stream.wave + 1, ..stream };
            let secondary = PathRays::secondary(wave, rays, hits);
            // L_r and the light behind glass.
            let mut secondary = Compositor::new(frame, secondary);
            if compositor.collects_seen() && wave.rays.iter().any(|ray| ray.seen_share > 0.0) {
                secondary.collect_seen();
            }
            if compositor.collects_layers() {
                secondary.collect_emission();
            }
            self.trace(frame, &mut secondary, stream, buffers, shadow, waves);
            compositor.add_secondary(wave, secondary);
        }
        waves.push(next);
    }

    /// k_e + k_a I_a at a surface with shading normal `n`.
    #[inline(always)]
    fn base_radiance(&self, frame: &Frame, k: BaseTerms, n: DVec3) -> Rgb {
        match self.stage {
            Stage::Color => k.color,
            Stage::Diffuse | Stage::Shadow => Rgb::ZERO,
            Stage::Phong => k.k_e + k.k_a * frame.ambient_at(n),
        }
    }

    /// Adds the light of all sources to the points of `batch`, whose radiance is k_e + k_a I_a.
    fn shade(
        &self,
        frame: &Frame,
        compositor: &Compositor,
        batch: &mut ShadingBatch,
        stream: SampleStream,
        shadow: &mut ShadowBuffers,
    ) {
        if self.stage == Stage::Color {
            if compositor.collects_layers() {
                batch.start_layers();
            }
            return;
        }
        let is_full_model = self.stage == Stage::Phong;
        let has_shadows = frame.shadows && self.stage != Stage::Diffuse;
        if is_full_model {
            batch.soa.compute_view_dirs(frame.simd(), frame.traces_full_paths());
            if frame.leaves_out_caustics() {
                remove_specular_lobes(frame, batch, compositor.rays.states);
            }
            apply_specular_layers(frame, batch);
            if stream.wave > 0 && !frame.traces_full_paths() {
                limit_highlights(frame, batch);
            }
            if let Some(settings) = frame.ambient_occlusion.filter(|_| frame.indirect == 0) {
                occlude_ambient(frame, settings, batch, compositor.rays.states, stream, shadow);
            }
        }
        let has_layers = compositor.collects_layers();
        if has_layers {
            batch.start_layers();
        }
        let choice = LightChoice::new(frame, batch, compositor.rays.states, stream);
        for (i, light) in frame.lights.iter().enumerate() {
            let is_noisy = light.radius > 0.0 && compositor.splits_all();
            frame.simd().run(DirectLightKernel {
                points: &mut batch.soa,
                light,
                index: i,
                choice: &choice,
                has_specular: is_full_model,
                has_shadow_catcher: frame.has_shadow_catcher(),
                separates_specular: has_layers || is_noisy,
                shadow_rays: &mut shadow.rays,
            });
            if has_shadows {
                trace_visibility(frame, i, batch, stream, shadow);
                apply_visibility(batch, shadow);
                if has_layers || is_noisy {
                    apply_specular_visibility(batch, shadow);
                }
            }
            if is_noisy {
                batch.soa.accumulate_noisy();
            }
            batch.soa.accumulate(frame.simd());
            if has_layers {
                batch.assign_direct_light();
            }
        }
        let terms = LightTerms {
            has_specular: is_full_model,
            has_shadows,
            has_shadow_catcher: frame.has_shadow_catcher(),
            is_split: compositor.splits_all(),
            has_layers,
        };
        add_area_lights(frame, compositor, batch, stream, terms, &choice, shadow);
        if stream.wave > 0 && self.traces_indirect(frame) {
            add_light_beyond_last_bounce(frame, compositor, batch, stream, shadow);
        }
    }
}

/// Computes the unshadowed light of one source at all points, and lists the shadow rays to it.
struct DirectLightKernel<'a> {
    points: &'a mut PointsSoa,
    light: &'a PosedLight,
    /// Index of the light.
    index: usize,
    choice: &'a LightChoice,
    has_specular: bool,
    /// True if the light without shadows is summed as well.
    has_shadow_catcher: bool,
    /// True if the specular part of the light is wanted.
    separates_specular: bool,
    shadow_rays: &'a mut Vec<ShadowRay>,
}

impl AutovecKernel for DirectLightKernel<'_> {
    #[inline(always)]
    fn run(self) {
        let DirectLightKernel {
            points,
            light,
            index: light_index,
            choice,
            has_specular,
            has_shadow_catcher,
            separates_specular,
            shadow_rays,
        } = self;
        shadow_rays.clear();
        let intensity = light.intensity;
        let light = light.light_eval();
        let mut incident = IncidentLight::ZERO;
        for (index, (block, count)) in points.blocks_mut().enumerate() {
            let factors = choice.of_block(light_index, index * LANES);
            if factors.is_some_and(|factors| *factors == [0.0; LANES]) {
                block.clear_current_light();
                continue;
            }
            // l and I/r².
            incident.evaluate(&light, intensity, block);
            if let Some(factors) = factors {
                incident.scale(factors);
            }
            let lit_mask = incident.lit_mask(count);
            let has_specular_points = has_specular && block.has_specular && lit_mask != 0;
            if separates_specular {
                blinn_phong(block, &incident, false, &[1.0; LANES]);
                block.current_specular = block.current_light;
            }
            blinn_phong(block, &incident, has_specular_points, &[1.0; LANES]);
            if has_specular && lit_mask != 0 {
                add_layers(block, &incident);
            }
            if separates_specular {
                block.leave_specular_light();
            }
            if has_shadow_catcher {
                block.accumulate_unshadowed();
            }
            incident.push_shadow_rays(index * LANES, lit_mask, shadow_rays);
        }
    }
}

#[cfg(test)]
mod tests;
