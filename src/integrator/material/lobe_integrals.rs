//! The radiance of an environment averaged over whole lobes, by filtered importance sampling (Křivánek and Colbert,
//! “Real-time Shading with Filtered Importance Sampling”, EGSR 2008): a fixed set of directions drawn from the lobe, each
//! looked up with the solid angle that it stands for. Neighbouring pixels use the same set, so there is no noise.
//!
//! Lobes are collected and integrated together, so that the loops over a block are vectorised.

use std::f64::consts::PI;
use std::sync::OnceLock;

use crate::geometry::{Rgb, golden_angle};
use crate::integrator::material::directional_albedo::single_scattering_albedo;
use crate::integrator::material::fresnel::schlick_weight;
use crate::integrator::material::ggx::{reflected_pdf, sample_visible_normal_at, shadowing_ratio};
use crate::integrator::material::ggx_lobe::{FILTER_WIDTH, Lobe, LobeBasis};
use crate::integrator::surface::soa::{dvec3, set3};
use crate::scene::Environment;
use crate::simd::{AutovecKernel, SimdLevel};

/// Directions in the set of a pixel, shared among its samples.
const LOBE_DIRECTIONS: u32 = 32;
/// Lobes of a block.
const LANES: usize = 8;

/// Lobes over which the radiance is averaged.
#[derive(Default)]
pub(crate) struct LobeIntegrals {
    /// Full but for the last one.
    blocks: Vec<LobeBlock>,
    count: usize,
}

/// Lobes as structure of arrays. Lanes behind the last lobe repeat others.
#[derive(Clone)]
struct LobeBlock {
    /// [`LobeBasis`].
    x: [[f64; LANES]; 3],
    y: [[f64; LANES]; 3],
    z: [[f64; LANES]; 3],
    v: [[f64; LANES]; 3],
    /// GGX α.
    alpha: [f64; LANES],
    f0: [f64; LANES],
    /// Index of the first direction.
    first: [u32; LANES],
}

impl LobeBlock {
    const ZERO: LobeBlock = LobeBlock {
        x: [[0.0; LANES]; 3],
        y: [[0.0; LANES]; 3],
        z: [[0.0; LANES]; 3],
        v: [[0.0; LANES]; 3],
        alpha: [0.0; LANES],
        f0: [0.0; LANES],
        first: [0; LANES],
    };
}

impl LobeIntegrals {
    /// Adds a lobe, which is wider than a mirror's, with the directions of sample `index` of `samples`.
    pub fn push(&mut self, lobe: &Lobe, index: u32, samples: u32) {
        let lane = self.count % LANES;
        if lane == 0 {
            self.blocks.push(LobeBlock::ZERO);
        }
        self.count += 1;
        let Some(block) = self.blocks.last_mut() else { return };
        let basis = LobeBasis::new(lobe.n, lobe.v);
        // The first lobe also fills the lanes behind it, so that all have finite values.
        let end = if lane == 0 { LANES } else { lane + 1 };
        for lane in lane..end {
            set3(&mut block.x, lane, basis.x.to_array());
            set3(&mut block.y, lane, basis.y.to_array());
            set3(&mut block.z, lane, basis.z.to_array());
            set3(&mut block.v, lane, basis.v.to_array());
            block.alpha[lane] = lobe.alpha;
            block.f0[lane] = lobe.f0;
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
        let mut radiance = Vec::with_capacity(self.blocks.len() * LANES);
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
    blocks: &'a [LobeBlock],
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
            let mut sum = [Rgb::ZERO; LANES];
            for k in 0..self.per_sample {
                let directions = block.directions(k, self.total);
                let radiance = self.environment.radiance_of_lanes(&directions.l, &directions.solid_angle);
                for (i, sum) in sum.iter_mut().enumerate() {
                    *sum += radiance[i] * directions.weight[i];
                }
            }
            for (i, sum) in sum.iter_mut().enumerate() {
                let [cos, alpha, f0] = [block.v[2][i], block.alpha[i], block.f0[i]].map(|x| x as f32);
                *sum /= self.per_sample as f32 * single_scattering_albedo(cos, alpha, f0);
            }
            self.radiance.extend_from_slice(&sum);
        }
    }
}

/// One direction of each lobe of a block.
struct LobeDirections {
    /// Unit directions in the world.
    l: [[f32; LANES]; 3],
    /// The mean over all directions of the weight times the radiance, over the albedo, is the radiance averaged over the lobe. 0
    /// below the horizon.
    weight: [f32; LANES],
    /// Solid angles in steradians that the directions stand for.
    solid_angle: [f32; LANES],
}

impl LobeBlock {
    /// Direction number `k` of each lobe, of `total` in the pixel.
    #[inline(always)]
    fn directions(&self, k: u32, total: u32) -> LobeDirections {
        // Outside of the vectorised loop, because of its table.
        let mut around = [[0.0; 2]; LANES];
        for (around, first) in around.iter_mut().zip(self.first) {
            *around = direction_around(first + k);
        }
        let zero = [0.0; LANES];
        let mut out = LobeDirections { l: [zero; 3], weight: zero, solid_angle: zero };
        for (i, around) in around.into_iter().enumerate() {
            let v = dvec3(&self.v, i);
            let alpha = self.alpha[i];
            let f0 = self.f0[i];
            let u = (f64::from(self.first[i] + k) + 0.5) / f64::from(total);
            let m = sample_visible_normal_at(v, alpha, around, u);
            let v_m = v.dot(m);
            let l = m * (2.0 * v_m) - v;
            let world = dvec3(&self.x, i) * l.x + dvec3(&self.y, i) * l.y + dvec3(&self.z, i) * l.z;
            set3(&mut out.l, i, world.as_vec3().to_array());
            out.weight[i] =
                (shadowing_ratio(v.z, l.z, alpha) * (f0 + (1.0 - f0) * schlick_weight(v_m))) as f32;
            let solid_angle = FILTER_WIDTH / (f64::from(total) * reflected_pdf(v.z, m.z, alpha));
            out.solid_angle[i] = solid_angle.min(2.0 * PI) as f32;
        }
        out
    }
}

/// Cosine and sine of the angle of direction number `i`: steps of the golden angle, which together with equal steps of the
/// radius spread directions evenly.
fn direction_around(i: u32) -> [f64; 2] {
    let compute = |i: u32| golden_angle(i, 0.13);
    static DIRECTIONS: OnceLock<[[f64; 2]; TABULATED_ANGLES]> = OnceLock::new();
    let table = DIRECTIONS.get_or_init(|| std::array::from_fn(|i| compute(i as u32)));
    table.get(i as usize).copied().unwrap_or_else(|| compute(i))
}

/// Angles that are computed once.
const TABULATED_ANGLES: usize = 256;

#[cfg(test)]
mod tests;
