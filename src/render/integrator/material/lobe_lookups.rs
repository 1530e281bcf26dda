//! The radiance of an environment averaged over whole lobes, by one lookup for each. For weak lobes: a lookup ignores the
//! stretch of lobes at grazing angles.
//!
//! Lookups are collected and computed together, so that the loops over a block are vectorised.

use glam::Vec3;

use crate::integrator::material::ggx_lobe::{LOBE_LANES, Lobe};
use crate::integrator::material::lobe_moments::{LobeMoments, TablePosition};
use crate::integrator::surface::soa::{set3, vec3};
use blinn_core::geometry::Rgb;
use blinn_core::simd::{AutovecKernel, SimdLevel};
use blinn_scene::Environment;

/// Lobes whose radiance is looked up.
#[derive(Default)]
pub(crate) struct LobeLookups {
    /// Full but for the last one.
    blocks: Vec<LobeBlock>,
    count: usize,
}

/// Lobes as structure of arrays. Lanes behind the last lobe are 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LobeBlock {
    /// Shading normals.
    n: [[f32; LOBE_LANES]; 3],
    /// Unit directions to the viewer.
    v: [[f32; LOBE_LANES]; 3],
    /// GGX α.
    alpha: [f32; LOBE_LANES],
}

impl LobeLookups {
    /// Adds a lobe.
    pub fn push(&mut self, lobe: &Lobe) {
        let lane = self.count % LOBE_LANES;
        if lane == 0 {
            self.blocks.push(LobeBlock::ZERO);
        }
        self.count += 1;
        let Some(block) = self.blocks.last_mut() else { return };
        block.set(lane, lobe.n.as_vec3(), lobe.v.as_vec3(), lobe.alpha as f32);
    }

    /// Returns the radiance of each lobe, in the order in which they were added.
    pub fn radiance(&self, simd: SimdLevel, environment: &Environment) -> Vec<Rgb> {
        let mut radiance = Vec::with_capacity(self.blocks.len() * LOBE_LANES);
        simd.run(LookupKernel { blocks: &self.blocks, environment, radiance: &mut radiance });
        radiance.truncate(self.count);
        radiance
    }
}

/// [`LobeLookups::radiance`].
struct LookupKernel<'a> {
    blocks: &'a [LobeBlock],
    environment: &'a Environment,
    radiance: &'a mut Vec<Rgb>,
}

impl AutovecKernel for LookupKernel<'_> {
    #[inline(always)]
    fn run(self) {
        for block in self.blocks {
            self.radiance.extend_from_slice(&block.radiance(self.environment));
        }
    }
}

impl LobeBlock {
    pub const ZERO: LobeBlock =
        LobeBlock { n: [[0.0; LOBE_LANES]; 3], v: [[0.0; LOBE_LANES]; 3], alpha: [0.0; LOBE_LANES] };

    /// Sets lobe `i`: its shading normal, the direction to the viewer, and GGX α.
    #[inline(always)]
    pub fn set(&mut self, i: usize, n: Vec3, v: Vec3, alpha: f32) {
        set3(&mut self.n, i, n.to_array());
        set3(&mut self.v, i, v.to_array());
        self.alpha[i] = alpha;
    }

    /// Returns the radiance of each lobe.
    #[inline(always)]
    pub fn radiance(&self, environment: &Environment) -> [Rgb; LOBE_LANES] {
        if let Some(radiance) = environment.as_uniform() {
            return [radiance; LOBE_LANES];
        }
        let (directions, alpha) = self.symmetric_lobes();
        environment.prefiltered(&directions, &alpha)
    }

    /// The mean directions and α of the lobes at normal incidence that come closest to these.
    #[inline(always)]
    fn symmetric_lobes(&self) -> ([[f32; LOBE_LANES]; 3], [f32; LOBE_LANES]) {
        let mut cos = [0.0; LOBE_LANES];
        let mut positions = [TablePosition::default(); LOBE_LANES];
        for i in 0..LOBE_LANES {
            cos[i] = vec3(&self.n, i).dot(vec3(&self.v, i));
            positions[i] = TablePosition::new(cos[i], self.alpha[i]);
        }
        let [mut x, mut z, mut alpha] = [[0.0; LOBE_LANES]; 3];
        for i in 0..LOBE_LANES {
            let moments = LobeMoments::at(positions[i]);
            (x[i], z[i], alpha[i]) = (moments.x, moments.z, moments.alpha);
        }
        let mut directions = [[0.0; LOBE_LANES]; 3];
        for i in 0..LOBE_LANES {
            let n = vec3(&self.n, i);
            let away = (n * cos[i] - vec3(&self.v, i)).normalize_or(Vec3::ZERO);
            set3(&mut directions, i, (away * x[i] + n * z[i]).normalize_or(n).to_array());
        }
        (directions, alpha)
    }
}
