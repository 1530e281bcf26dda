//! The rays that specular lobes spawn, made for many points at once.

use glam::DVec3;

use crate::integrator::area_light_hits::area_light_hits;
use crate::integrator::block_lobes::{STRONG_IMPORTANCE, survival_probability};
use crate::integrator::environment_occlusion::LOOKUP_SHARE;
use crate::integrator::frame::Frame;
use crate::integrator::layers::block_layers::layer_view;
use crate::integrator::layers::facets::{AnisotropicFacets, LobeDirections};
use crate::integrator::lobe_light::{LightReceiver, LobeLight, LobeRequest};
use crate::integrator::lobe_samples::{LobeSample, LobeSamples, SampleLobes, SampleSettings, SampledLobes};
use crate::integrator::material::directional_albedo::COAT_F0;
use crate::integrator::material::ggx::NARROW_ALPHA;
use crate::integrator::material::ggx_lobe::{LOBE_LANES, Lobe};
use crate::integrator::paths::{AreaLightHits, Escape, PathState, PathStates, SecondaryRay, Wave};
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::soa::{dvec3, vec3};
use blinn_core::geometry::Rgb;

/// Pixels of fewer samples look up the environment over a lobe once for each sample.
const MIN_SAMPLES_OF_LOBES: u32 = 4;

/// Lobes of a smaller α show what they reflect sharply enough to tell where light changes.
pub(crate) const SEEN_ALPHA: f32 = 0.02;

/// Rays and requests for light that the points of a batch spawn.
pub(crate) struct SpawnedRays<'w> {
    pub wave: &'w mut Wave,
    pub light: LobeLight,
}

/// Collects the lobes of a batch that spawn rays. Their rays are made when there are enough of them.
pub(crate) struct ReflectionRays<'a> {
    frame: &'a Frame<'a>,
    states: PathStates<'a>,
    stream: SampleStream<'a>,
    facets: PendingLobes,
    coats: PendingLobes,
}

/// Lobes of one layer that wait for their rays.
struct PendingLobes {
    dimension: SampleDimension,
    lobes: SampledLobes,
    rays: [PendingRay; LOBE_LANES],
    count: usize,
}

/// A ray without direction.
#[derive(Clone, Copy)]
struct PendingRay {
    /// Index of the point.
    point: usize,
    /// Share of the light from the lobe that arrives at the origin of the path's ray.
    arrives: Rgb,
    /// The brightest channel of `arrives`, times the importance of the path.
    importance: f32,
    /// Probability with which the lobe spawns a ray.
    survival: f32,
    /// Share of what the path sees that the lobe shows; 0 for a wide one.
    seen_share: f32,
}

impl PendingRay {
    const NONE: PendingRay =
        PendingRay { point: 0, arrives: Rgb::ZERO, importance: 0.0, survival: 1.0, seen_share: 0.0 };
}

impl PendingLobes {
    fn new(dimension: SampleDimension) -> PendingLobes {
        PendingLobes { dimension, lobes: SampledLobes::ZERO, rays: [PendingRay::NONE; LOBE_LANES], count: 0 }
    }
}

/// A specular layer of a point.
struct ReflectingLayer {
    /// Share of the light from the lobe that is reflected.
    k_r: Rgb,
    /// Share of the environment that reaches the lobe where no ray is traced.
    occlusion: f32,
    /// Share of the light that all layers reflect.
    share: f32,
    /// GGX α of the material.
    alpha: f32,
    lobe: Lobe,
    /// True at a layered point.
    is_layered: bool,
    /// Facets in place of the isotropic ones of `lobe`.
    anisotropic: Option<AnisotropicFacets>,
}

impl<'a> ReflectionRays<'a> {
    pub fn new(frame: &'a Frame<'a>, states: PathStates<'a>, stream: SampleStream<'a>) -> ReflectionRays<'a> {
        ReflectionRays {
            frame,
            states,
            stream,
            facets: PendingLobes::new(SampleDimension::Reflection),
            coats: PendingLobes::new(SampleDimension::Coat),
        }
    }

    /// Spawns the rays of the microfacets and of the coat of point `i`, and requests the environment's light where none is
    /// needed. `throughput` is the share of the point's light that arrives at the origin of the path's ray.
    pub fn spawn(&mut self, batch: &ShadingBatch, i: usize, throughput: Rgb, spawned: &mut SpawnedRays) {
        let (block, lane) = batch.soa.lane(i);
        let layers = block.k.layers.get(lane);
        let layered = block.layered.get(lane);
        let n = block.n_specular(lane);
        let lobe = |n: DVec3, alpha: f32, f0: f32| Lobe {
            n,
            v: block.v(lane),
            alpha: f64::from(alpha),
            f0: f64::from(f0),
        };
        let k_r: Rgb = vec3(&block.k_r, lane);
        let [of_facets, of_coat] = [k_r.element_sum() * (1.0 / 3.0), block.k_r_coat[lane]];
        let mean_f0 = layered.map_or_else(|| layers.mean_f0(), |point| point.mean_f0(&layers));
        let share = |of_layer: f32| if of_layer > 0.0 { of_layer / (of_facets + of_coat) } else { 0.0 };
        let microfacets = ReflectingLayer {
            k_r,
            share: share(of_facets),
            occlusion: layers.occlusion,
            alpha: layers.alpha,
            lobe: lobe(n, block.lobe_alpha[lane], mean_f0),
            is_layered: layered.is_some(),
            anisotropic: layer_view(block, lane).and_then(|(point, view)| point.anisotropic_facets(&view)),
        };
        let coat = ReflectingLayer {
            k_r: Rgb::splat(block.k_r_coat[lane]),
            share: share(of_coat),
            occlusion: 1.0,
            alpha: layers.coat_alpha,
            lobe: lobe(layered.map_or(n, |point| point.coat.n), block.coat_alpha[lane], COAT_F0),
            is_layered: layered.is_some(),
            anisotropic: None,
        };
        let n_g = dvec3(&block.n_g, lane);
        if let Some(ray) = self.pending_ray(batch, i, throughput, &microfacets, false, spawned) {
            match &microfacets.anisotropic {
                Some(facets) => self.make_anisotropic_ray(batch, &microfacets.lobe, facets, &ray, spawned),
                None => self.facets.push(&microfacets.lobe, n_g, ray),
            }
        }
        if let Some(ray) = self.pending_ray(batch, i, throughput, &coat, true, spawned) {
            self.coats.push(&coat.lobe, n_g, ray);
        }
        if self.facets.is_full() || self.coats.is_full() {
            self.make_rays(batch, spawned);
        }
    }

    /// Makes the ray of anisotropic facets, whose mean reflectance and normal are those of `lobe`.
    fn make_anisotropic_ray(
        &self,
        batch: &ShadingBatch,
        lobe: &Lobe,
        facets: &AnisotropicFacets,
        ray: &PendingRay,
        spawned: &mut SpawnedRays,
    ) {
        let ReflectionRays { frame, states, stream, .. } = *self;
        let maker = RayMaker { frame, states, stream, batch };
        let u = stream.get_2d(maker.path(ray), SampleDimension::Reflection);
        let (block, lane) = batch.soa.lane(ray.point);
        let settings = SampleSettings {
            count: stream.sampler.count,
            environment: frame.environment.as_ref(),
            ends_at_triangle: frame.traces_full_paths(),
        };
        let sample = LobeSample::of_facets(facets, lobe.f0 as f32, dvec3(&block.n_g, lane), u, &settings);
        maker.push(lobe, Some(facets), ray, &sample, spawned);
    }

    /// Makes the rays of all lobes that wait.
    pub fn make_rays(&mut self, batch: &ShadingBatch, spawned: &mut SpawnedRays) {
        let ReflectionRays { frame, states, stream, .. } = *self;
        for lobes in [&mut self.facets, &mut self.coats] {
            lobes.make_rays(&RayMaker { frame, states, stream, batch }, spawned);
        }
    }

    /// The ray of a lobe, if it spawns one. A strong lobe that does not requests the environment's light.
    fn pending_ray(
        &self,
        batch: &ShadingBatch,
        point: usize,
        throughput: Rgb,
        layer: &ReflectingLayer,
        is_coat: bool,
        spawned: &mut SpawnedRays,
    ) -> Option<PendingRay> {
        let &ReflectingLayer { k_r, alpha, lobe, .. } = layer;
        if k_r == Rgb::ZERO {
            return None;
        }
        let path = batch.points[point].path;
        let arrives = throughput * k_r;
        let importance = self.states.importance(path) * arrives.max_element();
        let is_narrow = alpha <= NARROW_ALPHA;
        let survival =
            survival_probability(importance, is_narrow, self.stream.wave, self.frame.occludes_environment());
        if !self.states.may_reflect(path) || survival == 0.0 {
            // The light of weak lobes of plain points has been added for the whole block.
            let is_weak = importance < STRONG_IMPORTANCE;
            if (!is_weak || layer.is_layered) && self.frame.environment.is_some() {
                let weight = k_r * layer.occlusion;
                let request = LobeRequest { lobe, receiver: LightReceiver::Point(point), weight };
                let sample = self.stream.samples[path].index;
                match (layer.anisotropic, is_weak) {
                    (Some(facets), _) => {
                        let directions = if is_weak {
                            LobeDirections::ALL
                        } else {
                            LobeDirections::of_sample(sample, self.stream.sampler.count)
                        };
                        spawned.light.integrate_anisotropic(request.anisotropic(facets, directions));
                    }
                    (None, true) => spawned.light.look_up(request),
                    (None, false) => spawned.light.integrate(request, sample),
                }
            }
            return None;
        }
        let seen_share = if alpha < SEEN_ALPHA && layer.anisotropic.is_none() {
            throughput.element_sum() * (1.0 / 3.0) * layer.share
        } else {
            0.0
        };
        if survival < 1.0 {
            let u = self.stream.get_2d(path, SampleDimension::Roulette)[usize::from(is_coat)];
            if u >= survival {
                spawned.wave.leave_out(path, seen_share);
                return None;
            }
        }
        Some(PendingRay { point, arrives, importance, survival, seen_share })
    }
}

impl PendingLobes {
    fn is_full(&self) -> bool {
        self.count == LOBE_LANES
    }

    fn push(&mut self, lobe: &Lobe, n_g: DVec3, ray: PendingRay) {
        // The remainder lets the compiler drop the bounds checks.
        let lane = self.count % LOBE_LANES;
        self.lobes.set(lane, lobe, n_g);
        self.rays[lane] = ray;
        self.count += 1;
    }

    /// Makes the rays of all lobes, and removes them.
    fn make_rays(&mut self, maker: &RayMaker, spawned: &mut SpawnedRays) {
        let rays = &self.rays[..self.count];
        self.count = 0;
        if rays.is_empty() {
            return;
        }
        let samples = maker.sample(&self.lobes, rays, self.dimension);
        for (lane, ray) in rays.iter().enumerate() {
            maker.push(&self.lobes.get(lane), None, ray, &samples.get(lane), spawned);
        }
    }
}

/// The frame, the paths and the points that rays of lobes are made from.
struct RayMaker<'a, 's> {
    frame: &'a Frame<'a>,
    states: PathStates<'a>,
    stream: SampleStream<'a>,
    batch: &'a ShadingBatch<'s>,
}

impl RayMaker<'_, '_> {
    fn path(&self, ray: &PendingRay) -> usize {
        self.batch.points[ray.point].path
    }

    /// Samples a direction of each lobe.
    fn sample(&self, lobes: &SampledLobes, rays: &[PendingRay], dimension: SampleDimension) -> LobeSamples {
        let mut positions = [None; LOBE_LANES];
        for (position, ray) in positions.iter_mut().zip(rays) {
            *position = self.stream.sequence_position(self.path(ray), 1);
        }
        let simd = self.frame.simd();
        let alone = |i: usize| self.stream.get_2d(self.path(&rays[i]), dimension);
        let u = self.stream.points_of_lanes(simd, dimension, &positions, rays.len(), alone);
        let mut samples = LobeSamples::ZERO;
        simd.run(SampleLobes {
            lobes,
            u: &u,
            count: self.stream.sampler.count,
            environment: self.frame.environment.as_ref(),
            ends_at_triangle: self.frame.traces_full_paths(),
            has_filtered_light: rays.iter().any(|ray| ray.survival < 1.0),
            samples: &mut samples,
        });
        samples
    }

    /// Adds the ray of a lobe, perhaps of anisotropic facets, in the direction of its sample.
    fn push(
        &self,
        lobe: &Lobe,
        anisotropic: Option<&AnisotropicFacets>,
        ray: &PendingRay,
        sample: &LobeSample,
        spawned: &mut SpawnedRays,
    ) {
        let &LobeSample { direction, weight, is_cut, .. } = sample;
        let environment = self.frame.environment.as_ref();
        // A ray that the microfacets hide still brings its sample's share of the environment's light over the lobe.
        let is_empty = is_cut || (weight == 0.0 && environment.is_none());
        let &PendingRay { point, importance, survival, seen_share, .. } = ray;
        if self.frame.traces_full_paths() && is_empty {
            spawned.wave.leave_out(self.path(ray), seen_share);
            return;
        }
        // The ray stands for those that do not survive.
        let arrives = ray.arrives / survival;
        let path = self.path(ray);
        let Some(state) = self.states.get(path) else { return };
        let (block, block_lane) = self.batch.soa.lane(point);
        let is_uniform = environment.is_some_and(|e| e.as_uniform().is_some());
        // Surfaces seen in a weak lobe count at most as much as the environment that they hide: a light would be a white dot.
        let max_light = match environment {
            Some(_) if survival < 1.0 && self.frame.indirect == 0 => {
                (sample.filtered_light * arrives * weight).max_element()
            }
            _ => f32::INFINITY,
        };
        let (origin, source) = self.batch.offset_origin(point, direction);
        let solid_angle = sample.solid_angle * LOOKUP_SHARE as f32;
        let state = PathState {
            origin,
            width: state.width_at(vec3(&block.p, block_lane)),
            spread: state.spread + 2.0 * block.normal_change(block_lane) + solid_angle.sqrt(),
            importance: importance / survival,
            reflections_left: state.reflections_left - 1,
            ..state
        };
        // Under a uniform environment, the weights of escaping rays have no noise already.
        if environment.is_some() && !is_uniform {
            let receiver = LightReceiver::Ray(spawned.wave.rays.len());
            let request = LobeRequest { lobe: *lobe, receiver, weight: arrives };
            self.request_unoccluded(request, anisotropic, path, importance, &mut spawned.light);
        }
        let ray = SecondaryRay {
            parent: path,
            weight: arrives * weight,
            // The mean of the weight is 1.
            escape_weight: if is_uniform { arrives } else { arrives * weight },
            bump_shadowing: 1.0,
            max_light,
            escape: Escape::Radiance(sample.sharp_light),
            // Set when the light of all lobes is computed.
            unoccluded: None,
            direction: direction.as_vec3(),
            source,
            is_diffuse: false,
            is_rough: !lobe.is_mirror() || anisotropic.is_some(),
            seen_share,
            area_lights: match anisotropic {
                Some(facets) => AreaLightHits::Weighted(survival * facets.pdf(direction.as_vec3())),
                None => area_light_hits(lobe.n, direction, lobe.v, lobe.alpha, survival),
            },
            state,
        };
        spawned.wave.push(ray, self.stream.samples[path]);
    }

    /// Requests the light of the environment over the lobe of a ray that is traced, if nothing hid it.
    fn request_unoccluded(
        &self,
        request: LobeRequest,
        anisotropic: Option<&AnisotropicFacets>,
        path: usize,
        importance: f32,
        light: &mut LobeLight,
    ) {
        // Alone, a sample would need many directions.
        let is_alone = self.stream.wave > 0 || self.stream.sampler.count < MIN_SAMPLES_OF_LOBES;
        if let Some(&facets) = anisotropic {
            let (sample, samples) = (self.stream.samples[path].index, self.stream.sampler.count);
            let directions =
                if is_alone { LobeDirections::ALL } else { LobeDirections::of_sample(sample, samples) };
            light.integrate_anisotropic(request.anisotropic(facets, directions));
            return;
        }
        // The error of a single lookup is not seen in a weak lobe.
        if is_alone || importance < STRONG_IMPORTANCE {
            light.look_up(request);
        } else {
            light.integrate(request, self.stream.samples[path].index);
        }
    }
}
