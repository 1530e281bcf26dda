//! The choice of lights behind a diffuse bounce or a wide lobe: of many lights, a few random ones shine on each point.
//!
//! Shadow rays to each of many lights at each bounce cost time, and the light of a bounce is a mean over many paths anyway.
//! Points there pick lights with probabilities in proportion to an estimate of the light without shadows (Shirley, Wang
//! and Zimmerman, “Monte Carlo Techniques for Direct Lighting Calculations”, ACM TOG 1996), by one random number for all
//! picks: a light that is due more than once is always picked. Points that the eye sees, also in mirrors and through
//! glass, take the light of all lights.

use glam::Vec3;

use crate::integrator::direct_light::IncidentLight;
use crate::integrator::frame::Frame;
use crate::integrator::paths::{PathStates, SecondaryRay};
use crate::integrator::sample::{SampleDimension, SampleStream};
use crate::integrator::shading_batch::ShadingBatch;
use crate::integrator::surface::point_block::PointBlock;
use crate::integrator::surface::soa::{LANES, vec3};
use blinn_core::simd::AutovecKernel;
use blinn_scene::PosedAreaLight;

/// Number of lights that a point picks.
const PICKS: usize = 2;
/// Number of lights up to which all of them shine.
const MAX_LIGHTS: usize = 4;
/// Least cosine of an estimate, as parts of a light or lobes may be seen less obliquely than its centre and the normal.
const LEAST_COSINE: f32 = 0.1;

/// The factor of each light at each point of a batch: its number of picks over the number that is expected. First the
/// lights of the frame, then its area lights.
pub(crate) struct LightChoice {
    /// By light, then by point, up to whole blocks. Empty if all lights shine on all points.
    factors: Vec<[f32; LANES]>,
    blocks: usize,
}

impl LightChoice {
    /// All lights shine on all points.
    pub const ALL: LightChoice = LightChoice { factors: Vec::new(), blocks: 0 };

    /// Picks the lights of the points of a batch.
    pub fn new(frame: &Frame, batch: &ShadingBatch, states: PathStates, stream: SampleStream) -> LightChoice {
        let lights = frame.lights.len() + frame.area_lights.len();
        let picks =
            |i: usize| states.secondary(batch.points[i].path).is_some_and(|ray| picks_lights(frame, ray));
        if lights <= MAX_LIGHTS || stream.wave == 0 || !(0..batch.points.len()).any(picks) {
            return LightChoice::ALL;
        }
        let blocks = batch.points.len().div_ceil(LANES);
        let mut choice = LightChoice { factors: vec![[1.0; LANES]; lights * blocks], blocks };
        let mut estimates = vec![[0.0; LANES]; lights];
        for first in (0..batch.points.len()).step_by(LANES) {
            let points = first..batch.points.len().min(first + LANES);
            if !points.clone().any(picks) {
                continue;
            }
            let (block, _) = batch.soa.lane(first);
            frame.simd().run(EstimateLights { frame, block, estimates: &mut estimates });
            for i in points.filter(|&i| picks(i)) {
                let u = stream.get_2d(batch.points[i].path, SampleDimension::LightChoice)[0];
                let lane = i % LANES;
                let factors = systematic_factors(estimates.iter().map(|light| light[lane]), u);
                for (light, factor) in factors.enumerate() {
                    choice.factors[light * choice.blocks + first / LANES][lane] = factor;
                }
            }
        }
        choice
    }

    /// Returns the factors of a light at the block that begins with point `first`; `None` if all are 1.
    pub fn of_block(&self, light: usize, first: usize) -> Option<&[f32; LANES]> {
        self.factors.get(light * self.blocks + first / LANES)
    }
}

/// True for a ray behind a diffuse bounce, and with bounced light also for one of a lobe so wide that it blurs what it shows.
fn picks_lights(frame: &Frame, ray: &SecondaryRay) -> bool {
    ray.state.is_indirect || (frame.indirect > 0 && ray.is_rough && ray.seen_share == 0.0)
}

/// The factors of lights with those estimates: the number of picks over that which is expected. Pick k falls on the light
/// whose part of the sum holds (k + u) / [`PICKS`].
fn systematic_factors(estimates: impl Iterator<Item = f32> + Clone, u: f32) -> impl Iterator<Item = f32> {
    let sum: f32 = estimates.clone().sum();
    // A sum without light, or one that is out of range, leaves no way to pick.
    let scale = if sum > 0.0 { PICKS as f32 / sum } else { 0.0 };
    let mut end = 0.0;
    let mut picked = 0.0;
    estimates.map(move |estimate| {
        let expected = estimate * scale;
        end += expected;
        let picked_before = picked;
        // Rounding must not add a pick.
        picked = (end.min(PICKS as f32) - u).ceil().max(0.0);
        let factor = (picked - picked_before) / expected;
        if expected > 0.0 && factor.is_finite() { factor } else { 0.0 }
    })
}

/// Estimates the light of each source at the points of a block, without shadows.
struct EstimateLights<'a> {
    frame: &'a Frame<'a>,
    block: &'a PointBlock,
    estimates: &'a mut [[f32; LANES]],
}

impl AutovecKernel for EstimateLights<'_> {
    #[inline(always)]
    fn run(self) {
        let EstimateLights { frame, block, estimates } = self;
        let (of_lights, of_area_lights) = estimates.split_at_mut(frame.lights.len());
        let mut incident = IncidentLight::ZERO;
        for (light, estimate) in frame.lights.iter().zip(of_lights) {
            incident.evaluate(&light.light_eval(), light.intensity, block);
            for (i, estimate) in estimate.iter_mut().enumerate() {
                let irradiance: Vec3 = vec3(&incident.irradiance, i);
                *estimate = irradiance.element_sum() * incident.n_dot_l[i].max(LEAST_COSINE);
            }
        }
        for (light, estimate) in frame.area_lights.iter().zip(of_area_lights) {
            for (i, estimate) in estimate.iter_mut().enumerate() {
                *estimate = area_light_estimate(light, vec3(&block.p, i), block.n(i).as_vec3());
            }
        }
    }
}

/// An estimate of the light of an area light at `p`, where the normal is `n`.
#[inline(always)]
fn area_light_estimate(light: &PosedAreaLight, p: Vec3, n: Vec3) -> f32 {
    let offset = light.centre - p;
    let distance2 = offset.length_squared();
    let extent2 = light.half_x.length_squared() + light.half_y.length_squared();
    let towards = -offset.dot(light.normal);
    let inv_distance = 1.0 / distance2.max(f32::MIN_POSITIVE).sqrt();
    let cosines =
        (towards * inv_distance).max(LEAST_COSINE) * (n.dot(offset) * inv_distance).max(LEAST_COSINE);
    let light = light.radiance.element_sum() * light.area() * cosines / (distance2 + extent2);
    // Nothing reaches what is behind it.
    if towards > 0.0 { light } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_average_to_one_and_strong_lights_are_always_picked() {
        let estimates = [0.0, 10.0, 1.0, 0.5, 0.0, 2.5, 1.0];
        let steps = 6000;
        let mut sums = [0.0; 7];
        for step in 0..steps {
            let u = (step as f32 + 0.5) / steps as f32;
            let factors: Vec<f32> = systematic_factors(estimates.into_iter(), u).collect();
            let picks: f32 = factors.iter().zip(estimates).map(|(f, e)| f * e * PICKS as f32 / 15.0).sum();
            assert!((picks - PICKS as f32).abs() < 1e-4, "{u}: {factors:?}");
            assert!(factors[1] > 0.0, "{u}: {factors:?}");
            for (sum, factor) in sums.iter_mut().zip(factors) {
                *sum += factor / steps as f32;
            }
        }
        for (mean, estimate) in sums.into_iter().zip(estimates) {
            let expected = if estimate > 0.0 { 1.0 } else { 0.0 };
            assert!((mean - expected).abs() < 2e-3, "{estimate}: {mean}");
        }
    }

    #[test]
    fn estimates_without_light_or_out_of_range_pick_nothing() {
        for estimates in [[0.0; 5], [f32::INFINITY, 1.0, 1.0, 1.0, 1.0], [f32::NAN; 5]] {
            let factors: Vec<f32> = systematic_factors(estimates.into_iter(), 0.5).collect();
            assert!(factors.iter().all(|factor| factor.is_finite()), "{estimates:?}: {factors:?}");
        }
    }
}
