//! The radiance of an environment averaged over whole lobes, by filtered importance sampling (Křivánek and Colbert,
//! “Real-time Shading with Filtered Importance Sampling”, EGSR 2008): a fixed set of directions drawn from the lobe, each
//! looked up with the solid angle that it stands for. Neighbouring pixels use the same set, so there is no noise.
//!
//! Lobes are collected and integrated together, so that the loops over a block are vectorised.

use std::sync::OnceLock;

use crate::integrator::material::directional_albedo::single_scattering_albedos;
use crate::integrator::material::facet_view::FacetView;
use crate::integrator::material::ggx_lobe::{LOBE_LANES, Lobe, Lobe16};
use crate::integrator::surface::soa::set3;
use blinn_core::geometry::{Rgb, golden_angle};
use blinn_core::simd::{AutovecKernel, SimdLevel};
use blinn_scene::Environment;

/// Directions in the set of a pixel, shared among its samples.
const LOBE_DIRECTIONS: u32 = 32;

/// Lobes over which the radiance is averaged.
#[derive(Default)]
pub(crate) struct LobeIntegrals {
    /// Full but for the last one.
    blocks: Vec<IntegrationBlock>,
    count: usize,
}

/// Lobes that are integrated together. Lanes behind the last lobe repeat another.
#[derive(Clone)]
struct IntegrationBlock {
    lobes: Lobe16,
    /// Index of the first direction of each lobe.
    first: [u32; LOBE_LANES],
}

impl IntegrationBlock {
    const ZERO: IntegrationBlock = IntegrationBlock { lobes: Lobe16::ZERO, first: [0; LOBE_LANES] };
}

impl LobeIntegrals {
    /// Adds a lobe, which is wider than a mirror's, with the directions of sample `index` of `samples`.
    pub fn push(&mut self, lobe: &Lobe, index: u32, samples: u32) {
        let lane = self.count % LOBE_LANES;
        if lane == 0 {
            self.blocks.push(IntegrationBlock::ZERO);
        }
        self.count += 1;
        let Some(block) = self.blocks.last_mut() else { return };
        // The first lobe also fills the lanes behind it, so that all have finite values.
        let end = if lane == 0 { LOBE_LANES } else { lane + 1 };
        for lane in lane..end {
            block.lobes.set(lane, lobe);
            block.first[lane] = (index % samples.max(1)) * directions_per_sample(samples);
        }
    }

    /// Returns the radiance of the environment for each lobe, in the order in which they were added: 1 under a white one.
    /// Directions below the horizon count as black, as they do in the lobe's albedo. `samples` is the number of samples of a
    /// pixel.
    pub fn radiance(&self, simd: SimdLevel, environment: &Environment, samples: u32) -> Vec<Rgb> {
        if let Some(radiance) = environment.as_uniform() {
            return vec![radiance; self.count];
        }
        let mut radiance = Vec::with_capacity(self.blocks.len() * LOBE_LANES);
        let per_sample = directions_per_sample(samples);
        let total = per_sample.saturating_mul(samples.max(1));
        simd.run(IntegralKernel {
            blocks: &self.blocks,
            environment,
            per_sample,
            total,
            radiance: &mut radiance,
        });
        radiance.truncate(self.count);
        radiance
    }
}

/// Directions of each of `samples` samples.
fn directions_per_sample(samples: u32) -> u32 {
    LOBE_DIRECTIONS.div_ceil(samples.max(1)).max(1)
}

/// [`LobeIntegrals::radiance`].
struct IntegralKernel<'a> {
    blocks: &'a [IntegrationBlock],
    environment: &'a Environment,
    per_sample: u32,
    /// Directions of a pixel.
    total: u32,
    radiance: &'a mut Vec<Rgb>,
}

impl AutovecKernel for IntegralKernel<'_> {
    #[inline(always)]
    fn run(self) {
        for block in self.blocks {
            let views = FacetViews::new(&block.lobes);
            let [alpha, f0] = [block.lobes.alpha(), block.lobes.f0()];
            let mut sum = [Rgb::ZERO; LOBE_LANES];
            for k in 0..self.per_sample {
                let directions = block.directions(&views, &f0, k, self.total);
                let radiance = self.environment.radiance_of_lanes(&directions.l, &directions.solid_angle);
                for (i, sum) in sum.iter_mut().enumerate() {
                    *sum += radiance[i] * directions.weight[i];
                }
            }
            let albedos = single_scattering_albedos(&views.cos(), &alpha, &f0);
            for (sum, albedo) in sum.iter_mut().zip(albedos) {
                *sum /= self.per_sample as f32 * albedo;
            }
            self.radiance.extend_from_slice(&sum);
        }
    }
}

/// The [`FacetView`] of each lobe of a block, in structure of arrays.
struct FacetViews([[f32; LOBE_LANES]; FacetView::LEN]);

impl FacetViews {
    #[inline(always)]
    fn new(lobes: &Lobe16) -> FacetViews {
        let mut views = FacetViews([[0.0; LOBE_LANES]; FacetView::LEN]);
        for i in 0..LOBE_LANES {
            for (lanes, x) in views.0.iter_mut().zip(lobes.facet_view(i).to_array()) {
                lanes[i] = x;
            }
        }
        views
    }

    #[inline(always)]
    fn get(&self, i: usize) -> FacetView {
        FacetView::from_array(self.0.each_ref().map(|lanes| lanes[i]))
    }

    /// Cosines to the viewer.
    #[inline(always)]
    fn cos(&self) -> [f32; LOBE_LANES] {
        let mut cos = [0.0; LOBE_LANES];
        for (i, cos) in cos.iter_mut().enumerate() {
            *cos = self.get(i).cos();
        }
        cos
    }
}

/// One direction of each lobe of a block.
struct LobeDirections {
    /// Unit directions in the world.
    l: [[f32; LOBE_LANES]; 3],
    /// The mean of weight × radiance over all directions, divided by the albedo, is the radiance averaged over the lobe. 0
    /// below the horizon.
    weight: [f32; LOBE_LANES],
    /// Solid angles in steradians that the directions stand for.
    solid_angle: [f32; LOBE_LANES],
}

impl IntegrationBlock {
    /// Direction number `k` of each lobe, of `total` in the pixel. `f0` is the lobes' reflectance at normal incidence.
    #[inline(always)]
    fn directions(&self, views: &FacetViews, f0: &[f32; LOBE_LANES], k: u32, total: u32) -> LobeDirections {
        // Outside of the vectorised loop, because of its table.
        let mut around = [[0.0; LOBE_LANES]; 2];
        for i in 0..LOBE_LANES {
            [around[0][i], around[1][i]] = direction_around(self.first[i] + k);
        }
        let zero = [0.0; LOBE_LANES];
        let mut out = LobeDirections { l: [zero; 3], weight: zero, solid_angle: zero };
        let total = total as f32;
        for i in 0..LOBE_LANES {
            let u = ((self.first[i] + k) as f32 + 0.5) / total;
            let sample = views.get(i).sample([around[0][i], around[1][i]], u, f0[i]);
            set3(&mut out.l, i, sample.l.to_array());
            out.weight[i] = sample.weight;
            out.solid_angle[i] = sample.solid_angle(total);
        }
        out
    }
}

/// Cosine and sine of the angle of direction number `i`: steps of the golden angle, which together with equal steps of the
/// radius spread directions evenly.
fn direction_around(i: u32) -> [f32; 2] {
    let compute = |i: u32| golden_angle(i, 0.13).map(|x| x as f32);
    static DIRECTIONS: OnceLock<[[f32; 2]; TABULATED_ANGLES]> = OnceLock::new();
    let table = DIRECTIONS.get_or_init(|| std::array::from_fn(|i| compute(i as u32)));
    table.get(i as usize).copied().unwrap_or_else(|| compute(i))
}

/// Angles that are computed once.
const TABULATED_ANGLES: usize = 256;

#[cfg(test)]
mod tests;
