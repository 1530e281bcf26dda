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

use crate::geometry::{Rgb, offset_ray_origin};
use crate::integrator::block_lobes::{BlockLobes, STRONG_IMPORTANCE, survival};
use crate::integrator::compositor::Compositor;
use crate::integrator::environment_occlusion::LOOKUP_SHARE;
use crate::integrator::frame::Frame;
use crate::integrator::lobe_light::{LightReceiver, LobeLight, LobeRequest};
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::material::directional_albedo::COAT_F0;
use crate::integrator::material::fresnel::fresnel_dielectric;
use crate::integrator::material::ggx::{NARROW_ALPHA, SMOOTH_GLASS_ALPHA};
use crate::integrator::material::ggx_lobe::{Lobe, LobeSample};
use crate::integrator::media::{Crossing, MediumStack};
use crate::integrator::paths::{Escape, MAX_CONTRIBUTION, PathState, PathStates, SecondaryRay, Wave};
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::soa::{LANES, dvec3, set3, vec3};

/// Pixels of fewer samples look up the environment over a lobe once for each sample.
const MIN_SAMPLES_OF_LOBES: u32 = 4;
/// Russian roulette: rays of glass that eye rays hit are spawned with a probability in proportion to their importance if it
/// is smaller, and count more instead.
const FIRST_ROULETTE_IMPORTANCE: f32 = 0.04;
/// The same for glass that secondary rays hit.
const ROULETTE_IMPORTANCE: f32 = 0.1;

/// A point of a path that spawns rays.
struct PathVertex<'a, 's> {
    frame: &'a Frame<'a>,
    batch: &'a ShadingBatch<'s>,
    stream: SampleStream<'a>,
    /// Index of the point in the batch.
    i: usize,
    k: &'a Coefficients,
    state: PathState,
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
    let mut spawned = Spawned { wave, light: LobeLight::new(stream.sampler.count) };
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
            let Some(state) = states.get(batch.points[i].path) else { continue };
            let throughput = compositor.throughput(batch, i);
            let vertex = PathVertex::new(frame, batch, stream, i, state, throughput);
            if let Some(crossing) = vertex.medium_crossing() {
                let environment_light = vertex.spawn_at_dielectric(&crossing, spawned.wave);
                add_radiance(batch, i, environment_light);
            } else {
                vertex.spawn_reflections(&mut spawned);
            }
        }
    }
    if let Some(environment) = &frame.environment {
        let Spawned { wave, light } = spawned;
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

/// Rays and requests for light that the points of a batch spawn.
struct Spawned<'w> {
    wave: &'w mut Wave,
    light: LobeLight,
}

/// A specular layer of a point.
struct ReflectingLayer {
    /// Share of the light from the lobe that is reflected.
    k_r: Rgb,
    /// Share of the environment that reaches the lobe where no ray is traced.
    occlusion: f32,
    /// GGX α of the material.
    alpha: f32,
    lobe: Lobe,
    dimension: SampleDimension,
}

/// A ray that leaves the surface of a body.
struct DielectricRay {
    /// Unit direction.
    direction: DVec3,
    /// Factor from this ray's radiance to that of the point.
    weight: Rgb,
    /// True for a ray that passes through the surface.
    is_refracted: bool,
    media: MediumStack,
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
            throughput,
            p: vec3(&block.p, lane),
            n: block.n(lane),
            n_g: dvec3(&block.n_g, lane),
            v: block.v(lane),
            normal_change: block.normal_change(lane),
        }
    }

    /// Index of the path.
    fn path(&self) -> usize {
        self.batch.points[self.i].path
    }

    /// The surface of the body that the point is on, if it refracts light there.
    fn medium_crossing(&self) -> Option<Crossing> {
        let id = self.batch.points[self.i].id;
        if !self.frame.refracts(id, self.k) {
            return None;
        }
        let entering = self.batch.is_front(self.i)?;
        Some(self.state.media.cross(self.frame.medium(id), entering))
    }

    /// Spawns the rays of the microfacets and of the coat, and requests the environment's light where none is needed.
    fn spawn_reflections(&self, spawned: &mut Spawned) {
        let (block, lane) = self.batch.soa.lane(self.i);
        let layers = &self.k.layers;
        let lobe =
            |alpha: f32, f0: f32| Lobe { n: self.n, v: self.v, alpha: f64::from(alpha), f0: f64::from(f0) };
        let microfacets = ReflectingLayer {
            k_r: vec3(&block.k_r, lane),
            occlusion: layers.occlusion,
            alpha: layers.alpha,
            lobe: lobe(block.lobe_alpha[lane], layers.mean_f0()),
            dimension: SampleDimension::Reflection,
        };
        let coat = ReflectingLayer {
            k_r: Rgb::splat(block.k_r_coat[lane]),
            occlusion: 1.0,
            alpha: layers.coat_alpha,
            lobe: lobe(block.coat_alpha[lane], COAT_F0),
            dimension: SampleDimension::Coat,
        };
        self.spawn_reflection(&microfacets, spawned);
        self.spawn_reflection(&coat, spawned);
    }

    fn spawn_reflection(&self, layer: &ReflectingLayer, spawned: &mut Spawned) {
        let &ReflectingLayer { k_r, alpha, lobe, .. } = layer;
        if k_r == Rgb::ZERO {
            return;
        }
        let arrives = self.throughput * k_r;
        let importance = self.state.importance * arrives.max_element();
        let is_narrow = alpha <= NARROW_ALPHA;
        let occludes_environment = self.frame.occludes_environment();
        let survival = survival(importance, is_narrow, self.stream.wave, occludes_environment);
        if self.state.reflections_left == 0 || survival == 0.0 {
            // The light of weak lobes has been added for the whole block.
            if !(importance < STRONG_IMPORTANCE) && self.frame.environment.is_some() {
                let weight = k_r * layer.occlusion;
                let request = LobeRequest { lobe, receiver: LightReceiver::Point(self.i), weight };
                spawned.light.integrate(request, self.stream.samples[self.path()].index);
            }
            return;
        }
        if survival < 1.0 && self.roulette_number(layer.dimension) >= survival {
            return;
        }
        // The ray stands for those that do not survive.
        let arrives = arrives / survival;
        let u = self.stream.get_2d(self.path(), layer.dimension).map(f64::from);
        let LobeSample { l, weight, solid_angle } = lobe.sample(u, self.stream.sampler.count);
        // A tilted normal or a wide lobe may point below the triangle.
        let direction = mirrored_to_side(l, self.n_g);
        let environment = self.frame.environment.as_ref();
        let is_uniform = environment.is_some_and(|e| e.as_uniform().is_some());
        let lookup_angle = solid_angle * LOOKUP_SHARE as f32;
        let escape = environment.map_or(Rgb::ZERO, |e| e.radiance(direction.as_vec3(), lookup_angle));
        // Surfaces seen in a weak lobe count at most as much as the environment that they hide: a lamp would be a white dot.
        let max_light = match environment {
            Some(environment) if survival < 1.0 => {
                (environment.radiance(direction.as_vec3(), solid_angle) * arrives * weight).max_element()
            }
            _ => MAX_CONTRIBUTION,
        };
        let (origin, source) = self.batch.offset_origin(self.i, direction);
        let state = PathState {
            origin,
            width: self.state.width_at(self.p),
            spread: self.state.spread + 2.0 * self.normal_change + solid_angle.sqrt(),
            importance: importance / survival,
            reflections_left: self.state.reflections_left - 1,
            ..self.state
        };
        // Under a uniform environment, the weights of escaping rays have no noise already.
        let needs_unoccluded = environment.is_some() && !is_uniform;
        if needs_unoccluded {
            let receiver = LightReceiver::Ray(spawned.wave.rays.len());
            self.request_unoccluded(
                LobeRequest { lobe, receiver, weight: arrives },
                importance,
                &mut spawned.light,
            );
        }
        let ray = SecondaryRay {
            parent: self.path(),
            weight: arrives * weight,
            // The mean of the weight is 1.
            escape_weight: if is_uniform { arrives } else { arrives * weight },
            max_light,
            escape: Escape::Radiance(escape),
            // Set when the light of all lobes is computed.
            unoccluded: None,
            direction: direction.as_vec3(),
            source,
            state,
        };
        spawned.wave.push(ray, self.stream.samples[self.path()]);
    }

    /// The random number that decides whether a weak lobe spawns a ray.
    fn roulette_number(&self, lobe: SampleDimension) -> f32 {
        let [facets, coat] = self.stream.get_2d(self.path(), SampleDimension::Roulette);
        if lobe == SampleDimension::Coat { coat } else { facets }
    }

    /// Requests the light of the environment over the lobe of a ray that is traced, if nothing hid it.
    fn request_unoccluded(&self, request: LobeRequest, importance: f32, light: &mut LobeLight) {
        // Alone, a sample would need many directions.
        let is_alone = self.stream.wave > 0 || self.stream.sampler.count < MIN_SAMPLES_OF_LOBES;
        // The error of a single lookup is not seen in a weak lobe.
        if is_alone || importance < STRONG_IMPORTANCE {
            light.look_up(request);
        } else {
            light.integrate(request, self.stream.samples[self.path()].index);
        }
    }

    /// Spawns a reflected and a refracted ray. Returns the environment's light in place of rays that are not traced.
    fn spawn_at_dielectric(&self, crossing: &Crossing, wave: &mut Wave) -> Rgb {
        let eta = crossing.eta;
        let m = self.sample_microfacet_normal();
        let cos = self.v.dot(m).clamp(0.0, 1.0);
        let reflectance = if eta == 1.0 {
            0.0
        } else {
            (fresnel_dielectric(cos, eta) as f32) * self.k.layers.dielectric_f90.min(1.0)
        };
        // The change of the normal across the ray cone, and the part of the microfacets' normals that this path stands for.
        let count = self.stream.sampler.count.max(1) as f32;
        let normal_change = self.normal_change + self.k.layers.alpha * (PI / count).sqrt();
        let [u_reflected, u_refracted] = self.stream.get_2d(self.path(), SampleDimension::Roulette);
        let reflected = DielectricRay {
            direction: m * (2.0 * self.v.dot(m)) - self.v,
            weight: Rgb::splat(reflectance),
            is_refracted: false,
            media: self.state.media,
            spread: self.state.spread + 2.0 * normal_change,
        };
        let mut environment_light = self.spawn_dielectric_ray(&reflected, u_reflected, wave);
        if reflectance < 1.0 {
            let refracted = DielectricRay {
                direction: refract(self.v, m, cos, eta),
                weight: self.surface_tint() * (self.k.transmission_weight * (1.0 - reflectance)),
                is_refracted: true,
                media: crossing.behind,
                spread: self.state.spread + (eta as f32 - 1.0).abs() * normal_change,
            };
            environment_light += self.spawn_dielectric_ray(&refracted, u_refracted, wave);
        }
        environment_light
    }

    /// The normal of a microfacet of glass that is visible from the path; the shading normal of smooth glass.
    fn sample_microfacet_normal(&self) -> DVec3 {
        let alpha = self.k.layers.alpha;
        if alpha < SMOOTH_GLASS_ALPHA {
            return self.n;
        }
        let u = self.stream.get_2d(self.path(), SampleDimension::Reflection).map(f64::from);
        Lobe { n: self.n, v: self.v, alpha: f64::from(alpha), f0: 1.0 }.sample_normal(u)
    }

    /// The tint of one surface of a body: the square root, because light passes two of them.
    fn surface_tint(&self) -> Rgb {
        let color = (self.k.k_t / self.k.transmission_weight).max(Rgb::ZERO);
        Rgb::new(color.x.sqrt(), color.y.sqrt(), color.z.sqrt())
    }

    /// Spawns a ray, or returns the environment's light in its direction instead.
    fn spawn_dielectric_ray(&self, ray: &DielectricRay, u: f32, wave: &mut Wave) -> Rgb {
        let &DielectricRay { weight, is_refracted, media, spread, .. } = ray;
        let arrives = self.throughput * weight;
        let importance = self.state.importance * arrives.max_element();
        if !(importance > 0.0) {
            return Rgb::ZERO;
        }
        let side = if is_refracted { -self.n_g } else { self.n_g };
        // Tilted normals may point rays to the wrong side of the triangle.
        let direction = mirrored_to_side(ray.direction, side).as_vec3();
        let environment = self.frame.environment.as_ref();
        let environment_radiance = || environment.map(|e| e.radiance(direction, spread * spread));
        if self.state.glass_events_left == 0 {
            return weight * environment_radiance().unwrap_or(Rgb::ZERO);
        }
        let Some(Survivor { weight, importance }) = self.play_roulette(arrives, importance, u) else {
            return Rgb::ZERO;
        };
        let escape = match environment_radiance() {
            Some(radiance) => Escape::Radiance(radiance),
            // Without an environment, the background is seen through glass, and nothing in it.
            None if is_refracted => Escape::Background,
            None => Escape::Radiance(Rgb::ZERO),
        };
        let state = PathState {
            origin: self.origin_on_side(is_refracted),
            width: self.state.width_at(self.p),
            spread,
            media,
            importance,
            glass_events_left: self.state.glass_events_left - 1,
            ..self.state
        };
        let parent = self.path();
        let ray = SecondaryRay {
            parent,
            weight,
            escape_weight: weight,
            max_light: MAX_CONTRIBUTION,
            escape,
            unoccluded: None,
            direction,
            source: self.batch.points[self.i].id,
            state,
        };
        wave.push(ray, self.stream.samples[parent]);
        Rgb::ZERO
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

    /// The origin of a ray on the viewer's side of the triangle, or behind it: clear of the error bound of the point.
    fn origin_on_side(&self, behind: bool) -> Vec3 {
        let (block, lane) = self.batch.soa.lane(self.i);
        let origin = vec3(&block.ray_origin, lane);
        if !behind {
            return origin;
        }
        let n_g = -self.n_g.as_vec3();
        offset_ray_origin(self.p - (origin - self.p), Vec3::ZERO, n_g, n_g)
    }
}

/// A ray that Russian roulette has left, with the weight and the importance that make up for the others.
struct Survivor {
    weight: Rgb,
    importance: f32,
}

/// `direction`, mirrored to the side that `n` points to.
fn mirrored_to_side(direction: DVec3, n: DVec3) -> DVec3 {
    let below = direction.dot(n).min(0.0);
    if below < 0.0 { (direction - n * (2.0 * below)).normalize_or(n) } else { direction }
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
