//! The rays that reflecting and refracting surfaces send out.
//!
//! A strong or narrow lobe sends out one ray for each sample. Where it hits a surface, that surface's light counts; where it
//! escapes, the light of the environment does, prefiltered over the part of the lobe that the sample stands for. Lobes that
//! are both weak and wide send out none: they look the environment up in the whole lobe.
//!
//! A body of glass sends out a reflected and a refracted ray, with the exact Fresnel equations.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use crate::geometry::{Rgb, offset_ray_origin};
use crate::integrator::frame::Frame;
use crate::integrator::layers::Layers;
use crate::integrator::material::coefficients::Coefficients;
use crate::integrator::material::environment_lobe::{LOBE_DIRECTIONS, Lobe, LobeSample, LobeSubset};
use crate::integrator::material::fresnel::fresnel_dielectric;
use crate::integrator::media::Medium;
use crate::integrator::paths::{Escape, PathState, SecondaryRay, Wave};
use crate::integrator::reflections::{reflecting_points, widened};
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::soa::{dvec3, set3, vec3};

/// Lobes of a smaller importance send out no rays unless they are narrow.
const STRONG_IMPORTANCE: f32 = 0.15;
/// Lobes of at most this α are narrow: they show what they reflect.
const NARROW_ALPHA: f32 = 0.1;
/// Largest importance of a lobe that is looked up in half as many directions.
const WEAK_IMPORTANCE: f32 = 0.1;
/// Smallest importance of a ray that is sent out.
const MIN_IMPORTANCE: f32 = 1.0 / 512.0;
/// Russian roulette: rays of glass that eye rays hit are sent out with a probability in proportion to their importance if it
/// is smaller, and count more instead.
const FIRST_ROULETTE_IMPORTANCE: f32 = 0.04;
/// The same for glass that secondary rays hit.
const ROULETTE_IMPORTANCE: f32 = 0.1;
/// Glass of a smaller α is smooth.
const SMOOTH_ALPHA: f32 = 1e-3;

/// True if a lobe is traced, not only looked up. What is seen in a reflection shows only its strong reflections: others
/// would double the rays with each wave.
fn is_traced(importance: f32, alpha: f32, wave: u32) -> bool {
    let is_seen = wave == 0 && alpha <= NARROW_ALPHA;
    importance >= if is_seen { MIN_IMPORTANCE } else { STRONG_IMPORTANCE }
}

/// A point that sends out rays.
struct Emitter<'a, 's> {
    frame: &'a Frame<'a>,
    points: &'a ShadingBatch<'s>,
    stream: SampleStream<'a>,
    i: usize,
    k: Coefficients,
    state: PathState,
    /// Share of the point's light that arrives at the origin of the wave.
    throughput: Rgb,
    p: Vec3,
    n: DVec3,
    n_g: DVec3,
    v: DVec3,
    /// Change of the normal across the beam.
    normal_change: f32,
}

/// Sends out the rays of the points of a layer. Light that is looked up instead is added to the points.
pub(crate) fn send_out_rays(
    frame: &Frame,
    layers: &Layers,
    points: &mut ShadingBatch,
    stream: SampleStream,
    wave: &mut Wave,
) {
    if layers.rays.states.is_empty() {
        return;
    }
    for i in reflecting_points(points) {
        let sample = points.points[i].sample;
        let state = layers.rays.states[sample];
        let k = *points.coefficients(i);
        let (block, lane) = points.soa.lane(i);
        let p = vec3(&block.p, lane);
        let throughput = layers.transmittance[sample] * state.transmittance_to(p) * k.alpha;
        if state.importance * throughput.max_element() < MIN_IMPORTANCE {
            continue;
        }
        let emitter = Emitter {
            frame,
            points,
            stream,
            i,
            k,
            state,
            throughput,
            p,
            n: block.n(lane),
            n_g: dvec3(&block.n_g, lane),
            v: block.v(lane),
            normal_change: block.normal_change(lane),
        };
        let looked_up = match points.is_front(i).and_then(|front| emitter.boundary(front)) {
            Some(boundary) => emitter.send_through_glass(&boundary, wave),
            None => emitter.send_reflections(wave),
        };
        if looked_up != Rgb::ZERO {
            let (block, lane) = points.soa.lane_mut(i);
            let radiance = vec3(&block.radiance, lane) + looked_up;
            set3(&mut block.radiance, lane, radiance.to_array());
        }
    }
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

/// The surface of a body.
struct Boundary {
    medium: Medium,
    entering: bool,
}

/// A ray that leaves the surface of a body.
struct GlassRay {
    /// Unit direction.
    l: DVec3,
    /// Share of the light from there that arrives at the viewer.
    weight: Rgb,
    /// True for a ray that passes through the surface.
    is_refracted: bool,
    state: PathState,
}

impl Emitter<'_, '_> {
    fn sample(&self) -> usize {
        self.points.points[self.i].sample
    }

    /// The boundary of the body that the point is on, if it is on one.
    fn boundary(&self, entering: bool) -> Option<Boundary> {
        let id = self.points.points[self.i].id;
        if self.k.transmission_share <= 0.0 || !self.frame.is_body(id) {
            return None;
        }
        Some(Boundary { medium: self.frame.medium(id), entering })
    }

    /// Sends out the rays of the microfacets and of the coat. Returns the light that is looked up instead.
    fn send_reflections(&self, wave: &mut Wave) -> Rgb {
        let (block, lane) = self.points.soa.lane(self.i);
        let layers = &self.k.layers;
        let roughness = block.roughness[lane];
        let lobe = |alpha: f32, f0: f32| Lobe {
            n: self.n,
            v: self.v,
            alpha: f64::from(widened(alpha, roughness)),
            f0: f64::from(f0),
        };
        let microfacets = ReflectingLayer {
            k_r: vec3(&block.k_r, lane),
            occlusion: layers.occlusion,
            alpha: layers.alpha,
            lobe: lobe(layers.alpha, layers.mean_f0()),
            dimension: SampleDimension::Reflection,
        };
        let coat = ReflectingLayer {
            k_r: Rgb::splat(block.k_coat[lane]),
            occlusion: 1.0,
            alpha: layers.coat_alpha,
            lobe: lobe(layers.coat_alpha, 0.04),
            dimension: SampleDimension::Coat,
        };
        self.send_reflection(&microfacets, wave) + self.send_reflection(&coat, wave)
    }

    fn send_reflection(&self, layer: &ReflectingLayer, wave: &mut Wave) -> Rgb {
        let &ReflectingLayer { k_r, alpha, .. } = layer;
        if k_r == Rgb::ZERO {
            return Rgb::ZERO;
        }
        let arrives = self.throughput * k_r;
        let importance = self.state.importance * arrives.max_element();
        if self.state.reflections_left == 0 || !is_traced(importance, alpha, self.stream.wave) {
            return k_r * layer.occlusion * self.environment_radiance(layer, importance);
        }
        let u = self.stream.get_2d(self.sample(), layer.dimension).map(f64::from);
        let LobeSample { l, weight, solid_angle } = layer.lobe.sample(u, self.stream.sampler.count);
        // A tilted normal or a wide lobe may point below the triangle.
        let l = above(l, self.n_g);
        let environment = self.frame.environment.as_ref();
        let is_uniform = environment.is_some_and(|e| e.as_uniform().is_some());
        let escape = environment.map_or(Rgb::ZERO, |e| e.radiance(l.as_vec3(), solid_angle));
        let (origin, _) = self.points.shadow_ray_origin(self.i, l);
        let state = PathState {
            origin,
            width: self.state.width_at(self.p),
            spread: self.state.spread + 2.0 * self.normal_change + solid_angle.sqrt(),
            importance,
            reflections_left: self.state.reflections_left - 1,
            ..self.state
        };
        let ray = SecondaryRay {
            parent: self.sample(),
            weight: arrives * weight,
            // The mean of the weight is 1.
            escape_weight: if is_uniform { arrives } else { arrives * weight },
            escape: Escape::Radiance(escape),
            direction: l.as_vec3(),
            state,
        };
        wave.push(ray, self.stream.samples[self.sample()]);
        Rgb::ZERO
    }

    /// The light of the environment that a layer reflects, averaged over its lobe.
    fn environment_radiance(&self, layer: &ReflectingLayer, importance: f32) -> Rgb {
        let Some(environment) = &self.frame.environment else { return Rgb::ZERO };
        // Errors of a weak lobe are not seen.
        let directions = if importance < WEAK_IMPORTANCE { LOBE_DIRECTIONS / 2 } else { LOBE_DIRECTIONS };
        let index = self.stream.samples[self.sample()].index;
        let subset = LobeSubset { index, count: self.stream.sampler.count, directions };
        layer.lobe.environment_radiance(environment, subset)
    }

    /// Sends out a reflected and a refracted ray. Returns the light that is looked up instead.
    fn send_through_glass(&self, boundary: &Boundary, wave: &mut Wave) -> Rgb {
        let before = self.state.media.current();
        let media = self.state.media.behind(boundary.medium, boundary.entering);
        let after = media.current();
        let eta = f64::from(after.ior) / f64::from(before.ior);
        let alpha = self.k.layers.alpha;
        let u = self.stream.get_2d(self.sample(), SampleDimension::Reflection).map(f64::from);
        let h = if alpha < SMOOTH_ALPHA {
            self.n
        } else {
            Lobe { n: self.n, v: self.v, alpha: f64::from(alpha), f0: 1.0 }.sample_normal(u)
        };
        let cos = self.v.dot(h).clamp(0.0, 1.0);
        let reflectance = if eta == 1.0 {
            0.0
        } else {
            (fresnel_dielectric(cos, eta) as f32) * self.k.layers.dielectric_f90.min(1.0)
        };
        let share = self.k.transmission_share;
        // Half of the tint at each of the two surfaces of a body.
        let color = (self.k.transmission / share).max(Rgb::ZERO);
        let tint = Rgb::new(color.x.sqrt(), color.y.sqrt(), color.z.sqrt());
        // The change of the normal across the beam, and the part of the microfacets' normals that this sample stands for.
        let count = self.stream.sampler.count.max(1) as f32;
        let normal_change = self.normal_change + alpha * (PI / count).sqrt();
        let spread = self.state.spread;
        let reflected = PathState { spread: spread + 2.0 * normal_change, ..self.state };
        let refracted =
            PathState { media, spread: spread + (eta as f32 - 1.0).abs() * normal_change, ..self.state };
        let roulette = self.stream.get_2d(self.sample(), SampleDimension::Roulette);
        let l = h * (2.0 * self.v.dot(h)) - self.v;
        let reflected =
            GlassRay { l, weight: Rgb::splat(reflectance), is_refracted: false, state: reflected };
        let mut looked_up = self.send_glass_ray(reflected, roulette[0], wave);
        if reflectance < 1.0 {
            let weight = tint * (share * (1.0 - reflectance));
            let l = refract(self.v, h, cos, eta);
            let refracted = GlassRay { l, weight, is_refracted: true, state: refracted };
            looked_up += self.send_glass_ray(refracted, roulette[1], wave);
        }
        looked_up
    }

    /// Sends out a ray, or returns the light that is looked up in its direction instead.
    fn send_glass_ray(&self, ray: GlassRay, roulette: f32, wave: &mut Wave) -> Rgb {
        let GlassRay { l, weight, is_refracted, state } = ray;
        let mut arrives = self.throughput * weight;
        let mut importance = self.state.importance * arrives.max_element();
        if !(importance > 0.0) {
            return Rgb::ZERO;
        }
        let side = if is_refracted { -self.n_g } else { self.n_g };
        // Tilted normals may point rays to the wrong side of the triangle.
        let l = above(l, side);
        let solid_angle = state.spread * state.spread;
        if self.state.transmissions_left == 0 {
            let environment = self.frame.environment.as_ref();
            return weight
                * environment
                    .map_or(Rgb::ZERO, |environment| environment.radiance(l.as_vec3(), solid_angle));
        }
        let threshold = if self.stream.wave == 0 { FIRST_ROULETTE_IMPORTANCE } else { ROULETTE_IMPORTANCE };
        if importance < threshold {
            let survival = importance / threshold;
            if roulette >= survival {
                return Rgb::ZERO;
            }
            arrives /= survival;
            importance = threshold;
        }
        let escape = match &self.frame.environment {
            Some(environment) => Escape::Radiance(environment.radiance(l.as_vec3(), solid_angle)),
            // Without an environment, the background is seen through glass, and nothing in it.
            None if is_refracted => Escape::Background,
            None => Escape::Radiance(Rgb::ZERO),
        };
        let state = PathState {
            origin: self.origin_on_side(is_refracted),
            width: self.state.width_at(self.p),
            importance,
            transmissions_left: self.state.transmissions_left - 1,
            ..state
        };
        let ray = SecondaryRay {
            parent: self.sample(),
            weight: arrives,
            escape_weight: arrives,
            escape,
            direction: l.as_vec3(),
            state,
        };
        wave.push(ray, self.stream.samples[self.sample()]);
        Rgb::ZERO
    }

    /// The origin of a ray on the viewer's side of the triangle, or behind it: clear of the error bound of the point.
    fn origin_on_side(&self, behind: bool) -> Vec3 {
        let (block, lane) = self.points.soa.lane(self.i);
        let origin = vec3(&block.ray_origin, lane);
        if !behind {
            return origin;
        }
        let n_g = -self.n_g.as_vec3();
        offset_ray_origin(self.p - (origin - self.p), Vec3::ZERO, n_g, n_g)
    }
}

/// The direction `l`, mirrored to the side that `n` points to.
fn above(l: DVec3, n: DVec3) -> DVec3 {
    let below = l.dot(n).min(0.0);
    if below < 0.0 { (l - n * (2.0 * below)).normalize_or(n) } else { l }
}

/// The direction of the ray from direction `v` that is refracted at a surface of normal `h`, by Snell's law. `cos` is v·h,
/// and `eta` the index of refraction behind the surface over that in front of it.
fn refract(v: DVec3, h: DVec3, cos: f64, eta: f64) -> DVec3 {
    let cos2_t = 1.0 - (1.0 - cos * cos) / (eta * eta);
    let cos_t = cos2_t.max(0.0).sqrt();
    (h * (cos / eta - cos_t) - v / eta).normalize_or(-v)
}

#[cfg(test)]
mod tests;
