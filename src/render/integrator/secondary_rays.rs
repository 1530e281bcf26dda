//! The rays that reflecting and refracting surfaces spawn.
//!
//! A strong or narrow lobe spawns one ray for each path. Where it hits a surface, that surface's light counts; where it
//! escapes, the light of the environment does, prefiltered over the part of the lobe that the ray stands for. Lobes that
//! are both weak and wide spawn none: they reflect the environment's light averaged over the whole lobe. With ambient
//! occlusion they spawn rays as well, for some of the paths.
//!
//! A body of glass spawns a reflected and a refracted ray, with the exact Fresnel equations.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use crate::integrator::block_lobes::BlockLobes;
use crate::integrator::compositor::Compositor;
use crate::integrator::environment_occlusion::LOOKUP_SHARE;
use crate::integrator::frame::Frame;
use crate::integrator::layers::block_layers::layer_view;
use crate::integrator::layers::dielectric_boundary::{BoundaryFilm, DielectricBoundary};
use crate::integrator::layers::facets::AnisotropicFacets;
use crate::integrator::lobe_light::{LightReceiver, LobeLight};
use crate::integrator::lobe_samples::mirrored_to_side;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::material::ggx::SMOOTH_GLASS_ALPHA;
use crate::integrator::material::ggx_lobe::{Lobe, MIN_COS};
use crate::integrator::material::glass_albedo::BlockingFacets;
use crate::integrator::media::{Crossing, MediumStack, Wavelength};
use crate::integrator::paths::{AreaLightHits, Escape, PathState, PathStates, SecondaryRay, Wave};
use crate::integrator::reflection_rays::{ReflectionRays, SEEN_ALPHA, SpawnedRays};
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::soa::{LANES, dvec3, set3, vec3};
use blinn_core::geometry::Rgb;

/// Russian roulette: rays of glass that eye rays hit are spawned with a probability in proportion to their importance if it
/// is smaller, and count more instead.
const FIRST_ROULETTE_IMPORTANCE: f32 = 0.04;
/// The same for glass that secondary rays hit.
const ROULETTE_IMPORTANCE: f32 = 0.1;

/// A point of a path on the surface of a body that refracts light.
struct PathVertex<'a, 's> {
    frame: &'a Frame<'a>,
    batch: &'a ShadingBatch<'s>,
    stream: SampleStream<'a>,
    /// Index of the point in the batch.
    i: usize,
    k: Coefficients,
    state: PathState,
    /// How the path's ray meets area lights.
    incoming_hits: AreaLightHits,
    /// Share of the point's light that arrives at the origin of the path's ray.
    throughput: Rgb,
    p: Vec3,
    n: DVec3,
    n_g: DVec3,
    v: DVec3,
    /// Change of the normal across the ray cone.
    normal_change: f32,
}

/// Spawns the rays of the points of a batch, before the batch is composited. Where no ray is needed, the environment's light
/// is added to the points.
pub(crate) fn spawn_rays(
    frame: &Frame,
    compositor: &Compositor,
    batch: &mut ShadingBatch,
    stream: SampleStream,
    wave: &mut Wave,
) {
    let states = compositor.rays.states;
    if matches!(states, PathStates::Unused) {
        return;
    }
    let mut spawned = SpawnedRays { wave, light: LobeLight::new(stream.sampler.count) };
    let mut reflections = ReflectionRays::new(frame, states, stream);
    for first in (0..batch.points.len()).step_by(LANES) {
        let lobes = BlockLobes::classify(frame, compositor, batch, first, stream.wave);
        if let Some(environment) = &frame.environment {
            let (block, _) = batch.soa.lane_mut(first);
            lobes.add_looked_up_light(frame.simd(), environment, block);
        }
        let mut spawning = lobes.spawning;
        while spawning != 0 {
            let i = first + spawning.trailing_zeros() as usize;
            spawning &= spawning - 1;
            let throughput = compositor.throughput(batch, i);
            if !frame.refracts(batch.points[i].id, &batch.coefficients(i)) {
                reflections.spawn(batch, i, throughput, &mut spawned);
                continue;
            }
            let Some(state) = states.get(batch.points[i].path) else { continue };
            let incoming = states.secondary(batch.points[i].path);
            let incoming_hits = incoming.map_or(AreaLightHits::Counted, |ray| ray.area_lights);
            let vertex =
                PathVertex { incoming_hits, ..PathVertex::new(frame, batch, stream, i, state, throughput) };
            let environment_light = vertex.spawn_at_dielectric(spawned.wave);
            add_radiance(batch, i, environment_light);
        }
    }
    reflections.make_rays(batch, &mut spawned);
    if let Some(environment) = &frame.environment {
        let SpawnedRays { wave, light } = spawned;
        light.compute(frame.simd(), environment, |receiver, light| match receiver {
            LightReceiver::Point(i) => add_radiance(batch, i, light),
            LightReceiver::Ray(i) => wave.rays[i].unoccluded = Some(light),
        });
    }
}

fn add_radiance(batch: &mut ShadingBatch, i: usize, light: Rgb) {
    let (block, lane) = batch.soa.lane_mut(i);
    let radiance = vec3(&block.radiance, lane) + light;
    set3(&mut block.radiance, lane, radiance.to_array());
}

/// The microfacets of rough glass.
struct GlassFacets {
    /// GGX α; of stretched facets that of round ones that are as rough.
    alpha: f32,
    stretched: Option<AnisotropicFacets>,
}

/// A ray that leaves the surface of a body.
struct DielectricRay {
    /// Unit direction.
    direction: DVec3,
    /// Factor from this ray's radiance to that of the point.
    weight: Rgb,
    /// Fresnel's share of the ray.
    share: f32,
    /// True for a ray that passes through the surface.
    is_refracted: bool,
    media: MediumStack,
    wavelength: Wavelength,
    /// Growth of the ray cone per metre.
    spread: f32,
}

impl<'a, 's> PathVertex<'a, 's> {
    fn new(
        frame: &'a Frame<'a>,
        batch: &'a ShadingBatch<'s>,
        stream: SampleStream<'a>,
        i: usize,
        state: PathState,
        throughput: Rgb,
    ) -> PathVertex<'a, 's> {
        let (block, lane) = batch.soa.lane(i);
        PathVertex {
            frame,
            batch,
            stream,
            i,
            k: batch.coefficients(i),
            state,
            incoming_hits: AreaLightHits::Counted,
            throughput,
            p: vec3(&block.p, lane),
            n: block.n_specular(lane),
            n_g: dvec3(&block.n_g, lane),
            v: block.v(lane),
            normal_change: block.normal_change(lane),
        }
    }

    /// Index of the path.
    fn path(&self) -> usize {
        self.batch.points[self.i].path
    }

    /// The surface of the body that the path crosses.
    fn medium_crossing(&self, wavelength: Wavelength) -> Crossing {
        let id = self.batch.points[self.i].id;
        // Only the ground has no front, and it is no body.
        let entering = self.batch.is_front(self.i).unwrap_or(true);
        self.frame.cross(&self.state.media, id, entering, wavelength)
    }

    /// The boundary that the path meets, of relative index `eta`.
    fn boundary(&self, eta: f64) -> DielectricBoundary {
        let layers = &self.k.layers;
        let entering = self.batch.is_front(self.i).unwrap_or(true);
        let (block, lane) = self.batch.soa.lane(self.i);
        let film = block.layered.get(lane).and_then(|point| point.film);
        DielectricBoundary {
            eta,
            f90: layers.dielectric_f90,
            film: film.map(|film| BoundaryFilm { film: film.over(layers), share: film.share, entering }),
        }
    }

    /// Spawns a reflected and a refracted ray. Returns the environment's light in place of rays that are not traced.
    fn spawn_at_dielectric(&self, wave: &mut Wave) -> Rgb {
        let white = self.medium_crossing(self.state.wavelength);
        let splits = white.disperses && self.state.wavelength == Wavelength::White;
        let facets = self.facets();
        let m = self.sample_microfacet_normal(facets.as_ref());
        let blocking = facets.and_then(|facets| self.blocking_facets(&facets));
        let compensation = |eta| blocking.map_or(Rgb::ONE, |facets| facets.compensation(eta));
        let visible_share = |cos_out| blocking.map_or(1.0, |facets| facets.visible_share(cos_out));
        let cos = self.v.dot(m).clamp(0.0, 1.0);
        let crossings = Wavelength::CHANNELS.map(|wavelength| match splits {
            true => (wavelength, self.medium_crossing(wavelength)),
            false => (self.state.wavelength, white),
        });
        // One crossing of all colours, or one of each.
        let crossings = &crossings[..if splits { 3 } else { 1 }];
        let reflectances = crossings.iter().map(|(wavelength, crossing)| {
            self.boundary(crossing.eta).reflectance(cos) * if splits { wavelength.mask() } else { Rgb::ONE }
        });
        let reflectance: Rgb = reflectances.reduce(|sum, of_channel| sum + of_channel).unwrap_or_default();
        let share = reflectance.max_element();
        // The change of the normal across the ray cone, and of the microfacets' normals.
        let sample_share = LOOKUP_SHARE as f32 / self.stream.sampler.count.max(1) as f32;
        let normal_change = self.normal_change + self.k.layers.alpha * (PI * sample_share).sqrt();
        let [u_reflected, u_refracted] = self.stream.get_2d(self.path(), SampleDimension::Roulette);
        let mirrored = m * (2.0 * self.v.dot(m)) - self.v;
        let compensation_of_white = compensation(white.eta);
        let visible = compensation_of_white * visible_share(self.n.dot(mirrored));
        let transmission = self.k.transmission_weight;
        let (block, lane) = self.batch.soa.lane(self.i);
        // The rest covers an opaque base, with what the base does not receive. It reflects alike on both sides.
        let above_base: Rgb = vec3(&block.k_r, lane);
        let reflected = DielectricRay {
            direction: mirrored,
            weight: reflectance * visible * transmission + above_base * (1.0 - transmission),
            share,
            is_refracted: false,
            media: self.state.media,
            wavelength: self.state.wavelength,
            spread: self.state.spread + 2.0 * normal_change,
        };
        let mut environment_light = self.spawn_dielectric_ray(&reflected, u_reflected, wave);
        for &(wavelength, Crossing { behind, eta, .. }) in crossings {
            let transmittance = (Rgb::ONE - reflectance) * if splits { wavelength.mask() } else { Rgb::ONE };
            if !(transmittance.max_element() > 0.0) {
                continue;
            }
            let direction = refract(self.v, m, cos, eta);
            let compensation = if splits { compensation(eta) } else { compensation_of_white };
            let visible = compensation * visible_share(-self.n.dot(direction));
            let refracted = DielectricRay {
                direction,
                weight: self.k.surface_tint() * (transmittance * transmission * visible),
                share: (1.0 - share) / crossings.len() as f32,
                is_refracted: true,
                media: behind,
                wavelength,
                spread: self.state.spread + (eta as f32 - 1.0).abs() * normal_change,
            };
            environment_light += self.spawn_dielectric_ray(&refracted, u_refracted, wave);
        }
        environment_light
    }

    /// The microfacets of rough glass; `None` for smooth glass.
    fn facets(&self) -> Option<GlassFacets> {
        let alpha = self.k.layers.alpha;
        if alpha < SMOOTH_GLASS_ALPHA {
            return None;
        }
        let (block, lane) = self.batch.soa.lane(self.i);
        let stretched = layer_view(block, lane).and_then(|(point, view)| point.anisotropic_facets(&view));
        Some(GlassFacets { alpha: stretched.map_or(alpha, |facets| facets.mean_alpha()), stretched })
    }

    /// The normal of a microfacet of glass that is visible from the path; the shading normal of smooth glass.
    fn sample_microfacet_normal(&self, facets: Option<&GlassFacets>) -> DVec3 {
        let Some(facets) = facets else { return self.n };
        let u = self.stream.get_2d(self.path(), SampleDimension::Reflection).map(f64::from);
        match facets.stretched {
            Some(facets) => facets.sample_normal(u),
            None => Lobe { n: self.n, v: self.v, alpha: f64::from(facets.alpha), f0: 1.0 }.sample_normal(u),
        }
    }

    /// The facets that block rays of rough glass; `None` where blocked rays are mirrored to their side.
    fn blocking_facets(&self, facets: &GlassFacets) -> Option<BlockingFacets> {
        self.frame.traces_full_paths().then(|| BlockingFacets {
            cos: self.n.dot(self.v).clamp(MIN_COS, 1.0),
            alpha: f64::from(facets.alpha),
            tint: self.k.surface_tint(),
        })
    }

    /// Spawns a ray, or returns the environment's light in its direction instead.
    fn spawn_dielectric_ray(&self, ray: &DielectricRay, u: f32, wave: &mut Wave) -> Rgb {
        let &DielectricRay { weight, share, is_refracted, media, wavelength, spread, .. } = ray;
        let arrives = self.throughput * weight;
        let importance = self.state.importance * arrives.max_element();
        if !(importance > 0.0) {
            return Rgb::ZERO;
        }
        let side = if is_refracted { -self.n_g } else { self.n_g };
        let seen_share = match self.k.layers.alpha < SEEN_ALPHA {
            true => self.throughput.element_sum() * (1.0 / 3.0) * share,
            false => 0.0,
        };
        if self.frame.traces_full_paths() && ray.direction.dot(side) <= 0.0 {
            wave.leave_out(self.path(), seen_share);
            return Rgb::ZERO;
        }
        // Tilted normals may point rays to the wrong side of the triangle.
        let direction = mirrored_to_side(ray.direction, side).as_vec3();
        let environment = self.frame.environment.as_ref();
        let environment_radiance = || environment.map(|e| e.radiance(direction, spread * spread));
        if self.state.glass_events_left == 0 {
            let seen = environment_radiance().filter(|_| !self.frame.traces_full_paths());
            return weight * seen.unwrap_or(Rgb::ZERO);
        }
        let mut reflections_left = self.state.reflections_left;
        if self.frame.traces_full_paths() && !is_refracted {
            if reflections_left == 0 {
                return Rgb::ZERO;
            }
            reflections_left -= 1;
        }
        let Some(Survivor { weight, importance }) = self.play_roulette(arrives, importance, u) else {
            wave.leave_out(self.path(), seen_share);
            return Rgb::ZERO;
        };
        let escape = match environment_radiance() {
            Some(radiance) => Escape::Radiance(radiance),
            // Without an environment, the background is seen through glass, and nothing in it.
            None if is_refracted => Escape::Background,
            None => Escape::Radiance(Rgb::ZERO),
        };
        let state = PathState {
            origin: if is_refracted {
                self.batch.origin_behind(self.i)
            } else {
                self.batch.origin_in_front(self.i)
            },
            width: self.state.width_at(self.p),
            spread,
            media,
            wavelength,
            importance,
            glass_events_left: self.state.glass_events_left - 1,
            reflections_left,
            ..self.state
        };
        let parent = self.path();
        let ray = SecondaryRay {
            parent,
            weight,
            escape_weight: weight,
            bump_shadowing: 1.0,
            max_light: f32::INFINITY,
            escape,
            unoccluded: None,
            direction,
            source: self.batch.points[self.i].id,
            is_diffuse: false,
            is_rough: false,
            seen_share,
            area_lights: self.area_light_hits(is_refracted),
            state,
        };
        wave.push(ray, self.stream.samples[parent]);
        Rgb::ZERO
    }

    /// How a ray that leaves the surface meets area lights. Shadow rays of matte surfaces pass glass straight: behind a diffuse
    /// bounce, they have found their share of the light behind it, and rays are weighted as if they had passed straight.
    fn area_light_hits(&self, is_refracted: bool) -> AreaLightHits {
        match (self.state.is_indirect, is_refracted) {
            (false, _) => AreaLightHits::Counted,
            (true, true) => self.incoming_hits,
            (true, false) => AreaLightHits::Ignored,
        }
    }

    /// Russian roulette with a random number `u`: `None` ends the ray.
    fn play_roulette(&self, weight: Rgb, importance: f32, u: f32) -> Option<Survivor> {
        let threshold = if self.stream.wave == 0 { FIRST_ROULETTE_IMPORTANCE } else { ROULETTE_IMPORTANCE };
        if !(importance < threshold) {
            return Some(Survivor { weight, importance });
        }
        let survival = importance / threshold;
        (u < survival).then(|| Survivor { weight: weight / survival, importance: threshold })
    }
}

/// A ray that Russian roulette has left, with the weight and the importance that make up for the others.
struct Survivor {
    weight: Rgb,
    importance: f32,
}

/// The direction of the ray from direction `v` that is refracted at a surface of normal `m`, by Snell's law. `cos` is v·m,
/// and `eta` the index of refraction behind the surface over that in front of it.
fn refract(v: DVec3, m: DVec3, cos: f64, eta: f64) -> DVec3 {
    let cos2_t = 1.0 - (1.0 - cos * cos) / (eta * eta);
    let cos_t = cos2_t.max(0.0).sqrt();
    (m * (cos / eta - cos_t) - v / eta).normalize_or(-v)
}

#[cfg(test)]
mod tests;
