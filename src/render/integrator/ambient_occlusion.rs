//! Ambient occlusion: the share of light from all directions that reaches a point.

use crate::integrator::ambient_rays::{AmbientRays, ComputeAmbientRays, LookUpEnvironment};
use crate::integrator::environment_occlusion::{OcclusionEstimate, arriving_light};
use crate::integrator::frame::{AmbientOcclusion, Frame};
use crate::integrator::paths::PathStates;
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::shadow_rays::ShadowBuffers;
use crate::integrator::surface::soa::{LANES, set3, vec3};
use blinn_accel::{Coherence, ShadowRayBatch};
use blinn_core::geometry::Rgb;
use blinn_scene::Environment;

/// Rays that are traced together, unless one point has more: the memory of a few ray streams.
const TRACED_RAYS: usize = 4096;

/// Sets the radiance of the points to k_e + k_a V_a I_a, where V_a is the visible share of all directions; under an
/// environment V_a I_a is the light from the visible directions. The radiance without shadows keeps all of I_a.
///
/// To be called before any light is added. It overwrites `traced_rays` and `visibility` of `buffers`.
pub(crate) fn occlude_ambient(
    frame: &Frame,
    settings: AmbientOcclusion,
    batch: &mut ShadingBatch,
    states: PathStates,
    stream: SampleStream,
    buffers: &mut ShadowBuffers,
) {
    let environment = frame.ambient_environment();
    let counts = ray_counts(frame, settings, batch, states, stream);
    let estimator = AmbientEstimator {
        frame,
        environment: environment.as_ref(),
        batch,
        stream,
        distance: settings.distance,
        counts,
    };
    let estimates = estimator.trace(buffers);
    let counts = estimator.counts;
    let lit = || (0..counts.len()).filter(|&i| counts[i] > 0);
    let arriving = environment.as_ref().map(|environment| {
        let estimate = |i: usize| OcclusionEstimate {
            pixel: stream.samples[batch.points[i].path].pixel,
            unoccluded: environment.diffuse(batch.n(i).as_vec3()),
            visibility: estimates[i].visibility,
            visible: estimates[i].visible,
            hidden: estimates[i].hidden,
        };
        arriving_light(&lit().map(estimate).collect::<Vec<_>>())
    });
    for (nth, i) in lit().enumerate() {
        let ambient = match &arriving {
            Some(arriving) => arriving[nth],
            None => frame.ambient_at(batch.n(i)) * estimates[i].visibility,
        };
        let (k_e, k_a) = batch.layered_ke_ka(i);
        let radiance = k_e + k_a * ambient;
        let (block, lane) = batch.soa.lane_mut(i);
        set3(&mut block.radiance, lane, radiance.to_array());
        let noisy: Rgb = vec3(&block.noisy_diffuse, lane);
        set3(&mut block.noisy_diffuse, lane, (noisy + k_a * ambient).to_array());
    }
}

/// The number of rays of each point; 0 where there is no ambient light.
///
/// The rays of a pixel are divided among its samples. Points seen in reflections and through glass are some among others
/// in a pixel: they get half as many, in proportion to the share of their light that arrives at the eye.
fn ray_counts(
    frame: &Frame,
    settings: AmbientOcclusion,
    batch: &ShadingBatch,
    states: PathStates,
    stream: SampleStream,
) -> Vec<u32> {
    let has_environment = frame.ambient_environment().is_some();
    let has_ambient = |i: usize| {
        let (_, k_a) = batch.layered_ke_ka(i);
        batch.coefficients(i).opacity > 0.0
            && k_a != Rgb::ZERO
            && (has_environment || k_a * frame.ambient_at(batch.n(i)) != Rgb::ZERO)
    };
    let first = settings.samples.div_ceil(stream.sampler.count.max(1)).max(1);
    let count = |i: usize| match states {
        _ if !has_ambient(i) => 0,
        PathStates::Secondary(_) => {
            let importance = states.importance(batch.points[i].path).min(1.0);
            ((0.5 * first as f32 * importance).round() as u32).max(1)
        }
        _ => first,
    };
    (0..batch.points.len()).map(count).collect()
}

/// Means over the rays of a point.
#[derive(Clone, Copy, Default)]
struct AmbientEstimate {
    /// V_a, the share of directions that is visible, by colour.
    visibility: Rgb,
    /// The environment's light that arrives.
    visible: Rgb,
    /// The environment's light that is hidden.
    hidden: Rgb,
}

/// Estimates the ambient light of a batch of points.
struct AmbientEstimator<'a, 's> {
    frame: &'a Frame<'s>,
    /// The environment that the ambient light comes from, unless it is a constant I_a.
    environment: Option<&'a Environment>,
    batch: &'a ShadingBatch<'s>,
    stream: SampleStream<'a>,
    /// Only nearer surfaces occlude.
    distance: f64,
    /// Number of rays of each point.
    counts: Vec<u32>,
}

/// Rays that wait to be traced.
#[derive(Default)]
struct PendingRays {
    /// Index of the point of each ray.
    points: Vec<u32>,
    /// The environment's light from its direction; empty without an environment.
    radiance: Vec<Rgb>,
}

impl AmbientEstimator<'_, '_> {
    /// Traces rays whose density is the cosine to the shading normal. Returns the estimate at each point.
    fn trace(&self, buffers: &mut ShadowBuffers) -> Vec<AmbientEstimate> {
        let mut sums = vec![AmbientEstimate::default(); self.counts.len()];
        let mut pending = PendingRays::default();
        buffers.traced_rays.clear();
        buffers.traced_rays.coherence = Coherence::None;
        for first in (0..self.counts.len()).step_by(LANES) {
            let counts = &self.counts[first..self.counts.len().min(first + LANES)];
            let positions = self.sequence_positions(first, counts);
            for part in 0..counts.iter().copied().max().unwrap_or(0) {
                if buffers.traced_rays.len() + counts.len() > TRACED_RAYS {
                    self.trace_pending(&mut pending, buffers, &mut sums);
                }
                self.push_rays(first, part, &positions, &mut pending, &mut buffers.traced_rays);
            }
        }
        self.trace_pending(&mut pending, buffers, &mut sums);
        let mean = |(sum, &count): (&AmbientEstimate, &u32)| {
            let AmbientEstimate { visibility, visible, hidden } = *sum;
            let count = count.max(1) as f32;
            AmbientEstimate {
                visibility: visibility / count,
                visible: visible / count,
                hidden: hidden / count,
            }
        };
        sums.iter().zip(&self.counts).map(mean).collect()
    }

    /// For each point of a block, the position of its first ray in the sampler's sequence.
    fn sequence_positions(&self, first: usize, counts: &[u32]) -> [Option<u64>; LANES] {
        let mut positions = [None; LANES];
        for ((position, point), &count) in positions.iter_mut().zip(&self.batch.points[first..]).zip(counts) {
            *position = self.stream.sequence_position(point.path, count);
        }
        positions
    }

    /// Appends ray number `part` of each point of the block whose first point is `first`, if it has as many.
    fn push_rays(
        &self,
        first: usize,
        part: u32,
        positions: &[Option<u64>; LANES],
        pending: &mut PendingRays,
        rays: &mut ShadowRayBatch,
    ) {
        let (block, _) = self.batch.soa.lane(first);
        let counts = &self.counts[first..self.counts.len().min(first + LANES)];
        let u = self.directions(first, part, positions);
        let mut computed = AmbientRays::ZERO;
        self.frame.simd().run(ComputeAmbientRays {
            block,
            u: &u,
            distance: self.distance,
            scene_radius: self.frame.posed.bounding_radius(),
            rays: &mut computed,
        });
        let mut lanes = [0; LANES];
        let mut active = 0;
        for (i, &count) in counts.iter().enumerate() {
            lanes[active] = i;
            active += usize::from(part < count);
        }
        let lanes = lanes[..active].iter();
        rays.from.extend(lanes.clone().map(|&i| computed.from(i)));
        rays.to.extend(lanes.clone().map(|&i| computed.to(i)));
        let source = |&i: &usize| self.batch.excluded_triangle(first + i, computed.in_front[i]);
        rays.source.extend(lanes.clone().map(source));
        pending.points.extend(lanes.map(|&i| (first + i) as u32));
        if let Some(environment) = self.environment {
            let radiance = self.look_up(environment, counts, &computed);
            let traced = counts.iter().zip(radiance).filter(|(count, _)| part < **count);
            pending.radiance.extend(traced.map(|(_, radiance)| radiance));
        }
    }

    /// The points of the unit square that the directions of ray number `part` of each point are made from.
    fn directions(&self, first: usize, part: u32, positions: &[Option<u64>; LANES]) -> [[f32; LANES]; 2] {
        let stream = &self.stream;
        let alone = |i: usize| {
            let path = self.batch.points[first + i].path;
            stream.get_2d_split(path, SampleDimension::Ambient, part, self.counts[first + i])
        };
        let positions = positions.map(|position| position.map(|first| first.wrapping_add(u64::from(part))));
        let count = LANES.min(self.counts.len() - first);
        stream.points_of_lanes(self.frame.simd(), SampleDimension::Ambient, &positions, count, alone)
    }

    /// The radiance of the environment along the rays of a block.
    fn look_up(&self, environment: &Environment, counts: &[u32], rays: &AmbientRays) -> [Rgb; LANES] {
        let mut rays_of_pixels = [1; LANES];
        for (of_pixel, count) in rays_of_pixels.iter_mut().zip(counts) {
            *of_pixel = count.saturating_mul(self.stream.sampler.count.max(1));
        }
        let mut radiance = [Rgb::ZERO; LANES];
        self.frame.simd().run(LookUpEnvironment {
            environment,
            rays,
            counts: &rays_of_pixels,
            radiance: &mut radiance,
        });
        radiance
    }

    /// Traces the rays that wait, and adds what they find to the sums of their points.
    fn trace_pending(
        &self,
        pending: &mut PendingRays,
        buffers: &mut ShadowBuffers,
        sums: &mut [AmbientEstimate],
    ) {
        let frame = self.frame;
        if frame.accel.has_translucent() {
            buffers.trace(frame);
            self.add_to_sums(pending, &buffers.traced_rays, buffers.visibility.iter().copied(), sums);
        } else {
            buffers.trace_occlusion(frame);
            let visibility = buffers.occluded.iter().map(|&hit| if hit { Rgb::ZERO } else { Rgb::ONE });
            self.add_to_sums(pending, &buffers.traced_rays, visibility, sums);
        }
        buffers.traced_rays.clear();
        pending.points.clear();
        pending.radiance.clear();
    }

    /// Adds the visibility of rays, and the environment's light along them, to the sums of their points.
    fn add_to_sums(
        &self,
        pending: &PendingRays,
        rays: &ShadowRayBatch,
        visibility: impl Iterator<Item = Rgb>,
        sums: &mut [AmbientEstimate],
    ) {
        let has_ground = self.frame.opaque_ground_height().is_some();
        let to_infinity = self.distance == f64::INFINITY;
        for (i, (&point, visibility)) in pending.points.iter().zip(visibility).enumerate() {
            let mut visibility = visibility;
            if has_ground {
                let to_end = rays.to[i].as_dvec3() - rays.from[i].as_dvec3();
                if self.frame.ground_blocks(rays.from[i], to_end, to_infinity) {
                    visibility = Rgb::ZERO;
                }
            }
            let sum = &mut sums[point as usize];
            sum.visibility += visibility;
            if let Some(&radiance) = pending.radiance.get(i) {
                sum.visible += visibility * radiance;
                sum.hidden += (Rgb::ONE - visibility) * radiance;
            }
        }
    }
}
