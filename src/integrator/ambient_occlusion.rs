//! Ambient occlusion: the share of light from all directions that reaches a point.

use std::f64::consts::PI;

use glam::DVec3;

use crate::accel::Coherence;
use crate::geometry::{Rgb, cosine_hemisphere};
use crate::integrator::environment_occlusion::{OcclusionEstimate, arriving_light};
use crate::integrator::frame::{AmbientOcclusion, Frame};
use crate::integrator::paths::PathState;
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::shadow_rays::ShadowBuffers;
use crate::integrator::surface::soa::{dvec3, set3};
use crate::scene::Environment;

/// Maximum solid angle of a lookup in the environment, in steradians: a hemisphere.
const MAX_SOLID_ANGLE: f64 = 2.0 * PI;

/// Sets the radiance of the points to k_e + k_a V_a I_a, where V_a is the visible share of all directions; under an
/// environment V_a I_a is the light from the visible directions. The radiance without shadows keeps all of I_a.
///
/// To be called before any light is added. It overwrites `traced_rays` and `visibility` of `buffers`.
pub(crate) fn occlude_ambient(
    frame: &Frame,
    settings: AmbientOcclusion,
    batch: &mut ShadingBatch,
    states: &[PathState],
    stream: SampleStream,
    buffers: &mut ShadowBuffers,
) {
    let environment = frame.ambient_environment();
    let has_ambient = |&i: &usize| {
        let (_, k_a) = batch.layered_ke_ka(i);
        batch.coefficients(i).opacity > 0.0
            && k_a != Rgb::ZERO
            && (environment.is_some() || k_a * frame.ambient_at(batch.n(i)) != Rgb::ZERO)
    };
    let indices: Vec<usize> = (0..batch.points.len()).filter(has_ambient).collect();
    let rays = AmbientRays::new(settings, batch, &indices, states, stream);
    let estimates = rays.trace(frame, environment, batch, stream, buffers);
    let ambient: Vec<Rgb> = match environment {
        Some(environment) => {
            let estimate = |(&i, estimate): (&usize, &AmbientEstimate)| OcclusionEstimate {
                pixel: stream.samples[batch.points[i].path].pixel,
                unoccluded: environment.diffuse(batch.n(i).as_vec3()),
                visibility: estimate.visibility,
                visible: estimate.visible,
                hidden: estimate.hidden,
            };
            arriving_light(&indices.iter().zip(&estimates).map(estimate).collect::<Vec<_>>())
        }
        None => {
            let ambient = |(&i, estimate): (&usize, &AmbientEstimate)| {
                frame.ambient_at(batch.n(i)) * estimate.visibility
            };
            indices.iter().zip(&estimates).map(ambient).collect()
        }
    };
    for (i, ambient) in indices.into_iter().zip(ambient) {
        let (k_e, k_a) = batch.layered_ke_ka(i);
        let radiance = k_e + k_a * ambient;
        let (block, lane) = batch.soa.lane_mut(i);
        set3(&mut block.radiance, lane, radiance.to_array());
    }
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

/// The rays of a batch of points for ambient light.
struct AmbientRays<'a> {
    /// Only nearer surfaces occlude.
    distance: f64,
    /// Indices of the points in the batch.
    points: &'a [usize],
    /// Number of rays of each point.
    counts: Vec<u32>,
}

impl<'a> AmbientRays<'a> {
    /// Divides the rays of a pixel among its samples. Points seen in reflections and through glass are some among others
    /// in a pixel: they get half as many, in proportion to the share of their light that arrives at the eye.
    fn new(
        settings: AmbientOcclusion,
        batch: &ShadingBatch,
        indices: &'a [usize],
        states: &[PathState],
        stream: SampleStream,
    ) -> AmbientRays<'a> {
        let first = settings.samples.div_ceil(stream.sampler.count.max(1)).max(1);
        let count = |&i: &usize| match states.get(batch.points[i].path) {
            Some(state) if stream.wave > 0 => {
                ((0.5 * first as f32 * state.importance.min(1.0)).round() as u32).max(1)
            }
            _ => first,
        };
        AmbientRays {
            distance: settings.distance,
            points: indices,
            counts: indices.iter().map(count).collect(),
        }
    }

    /// Traces rays whose density is the cosine to the shading normal. Returns the estimate at each point.
    fn trace(
        &self,
        frame: &Frame,
        environment: Option<&Environment>,
        batch: &ShadingBatch,
        stream: SampleStream,
        buffers: &mut ShadowBuffers,
    ) -> Vec<AmbientEstimate> {
        let mut sums = vec![AmbientEstimate::default(); self.points.len()];
        let mut radiance = Vec::new();
        for part in 0..self.counts.iter().copied().max().unwrap_or(0) {
            let active: Vec<usize> = (0..self.counts.len()).filter(|&i| part < self.counts[i]).collect();
            let traced_rays = &mut buffers.traced_rays;
            traced_rays.clear();
            traced_rays.coherence = Coherence::None;
            radiance.clear();
            for &i in &active {
                let (point, count) = (self.points[i], self.counts[i]);
                let (block, lane) = batch.soa.lane(point);
                let n_g = dvec3(&block.n_g, lane);
                let path = batch.points[point].path;
                let u = stream.get_2d_split(path, SampleDimension::Ambient, part, count);
                let n = block.n(lane);
                let l = cosine_hemisphere(n, u);
                if let Some(environment) = environment {
                    // In the direction before it is mirrored, so that the mean is that of the whole hemisphere.
                    let of_pixel = count.saturating_mul(stream.sampler.count.max(1));
                    radiance.push(lookup(environment, n, l, of_pixel));
                }
                // Directions into the triangle, which a tilted shading normal allows, are mirrored out.
                let l = l - n_g * (2.0 * l.dot(n_g).min(0.0));
                let (from, source) = batch.offset_origin(point, l);
                let distance = self.distance.min(frame.distance_beyond_scene(from));
                traced_rays.push(from, (from.as_dvec3() + l * distance).as_vec3(), source);
            }
            buffers.trace(frame);
            for (j, &i) in active.iter().enumerate() {
                let from = buffers.traced_rays.from[j];
                let to = buffers.traced_rays.to[j];
                let to_infinity = self.distance == f64::INFINITY;
                let is_blocked = frame.ground_blocks(from, to.as_dvec3() - from.as_dvec3(), to_infinity);
                let visibility = if is_blocked { Rgb::ZERO } else { buffers.visibility[j] };
                let radiance = radiance.get(j).copied().unwrap_or_default();
                sums[i].visibility += visibility;
                sums[i].visible += visibility * radiance;
                sums[i].hidden += (Rgb::ONE - visibility) * radiance;
            }
        }
        let mean = |(sum, &count): (&AmbientEstimate, &u32)| {
            let AmbientEstimate { visibility, visible, hidden } = *sum;
            let count = count as f32;
            AmbientEstimate {
                visibility: visibility / count,
                visible: visible / count,
                hidden: hidden / count,
            }
        };
        sums.iter().zip(&self.counts).map(mean).collect()
    }
}

/// The radiance of the environment from the unit direction `l`, averaged over the directions that one of `count` rays
/// stands for at a surface with normal `n`.
fn lookup(environment: &Environment, n: DVec3, l: DVec3, count: u32) -> Rgb {
    let density = n.dot(l).max(0.0) / PI;
    let solid_angle = (1.0 / (f64::from(count) * density)).min(MAX_SOLID_ANGLE);
    environment.radiance(l.as_vec3(), solid_angle as f32)
}
