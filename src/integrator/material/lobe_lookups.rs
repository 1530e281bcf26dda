//! The radiance of an environment averaged over whole lobes, by one lookup for each: for lobes that are too weak to show the
//! error.
//!
//! A lookup ignores the stretch of lobes at grazing angles. Lookups are collected and computed together, because all take
//! the same steps: the loops over a block are vectorised.

use glam::Vec3;

use crate::geometry::Rgb;
use crate::integrator::material::ggx_lobe::Lobe;
use crate::integrator::material::lobe_moments::{LobeMoments, TablePosition};
use crate::integrator::surface::soa::{set3, vec3};
use crate::scene::Environment;
use crate::simd::{AutovecKernel, SimdLevel};

/// Lobes of a block.
const LANES: usize = 16;

/// Lobes whose radiance is looked up.
#[derive(Default)]
pub(crate) struct LobeLookups {
    /// Full but for the last one.
    blocks: Vec<LobeBlock>,
    count: usize,
}

/// Lobes as structure of arrays. Lanes behind the last lobe are 0.
struct LobeBlock {
    /// Shading normals.
    n: [[f32; LANES]; 3],
    /// Unit directions to the viewer.
    v: [[f32; LANES]; 3],
    /// GGX α.
    alpha: [f32; LANES],
}

impl LobeLookups {
    /// Adds a lobe.
    pub fn push(&mut self, lobe: &Lobe) {
        let lane = self.count % LANES;
        if lane == 0 {
            let zero = [[0.0; LANES]; 3];
            self.blocks.push(LobeBlock { n: zero, v: zero, alpha: [0.0; LANES] });
        }
        self.count += 1;
        let Some(block) = self.blocks.last_mut() else { return };
        set3(&mut block.n, lane, lobe.n.as_vec3().to_array());
        set3(&mut block.v, lane, lobe.v.as_vec3().to_array());
        block.alpha[lane] = lobe.alpha as f32;
    }

    /// Returns the radiance of each lobe, in the order in which they were added.
    pub fn radiance(&self, simd: SimdLevel, environment: &Environment) -> Vec<Rgb> {
        if let Some(radiance) = environment.as_uniform() {
            return vec![radiance; self.count];
        }
        let mut radiance = Vec::with_capacity(self.blocks.len() * LANES);
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
            let (directions, alpha) = block.symmetric_lobes();
            self.radiance.extend_from_slice(&self.environment.prefiltered(&directions, &alpha));
        }
    }
}

impl LobeBlock {
    /// The mean directions and α of the lobes at normal incidence that come closest to these.
    #[inline(always)]
    fn symmetric_lobes(&self) -> ([[f32; LANES]; 3], [f32; LANES]) {
        let mut cos = [0.0; LANES];
        let mut positions = [TablePosition::default(); LANES];
        for i in 0..LANES {
            cos[i] = vec3(&self.n, i).dot(vec3(&self.v, i));
            positions[i] = TablePosition::new(cos[i], self.alpha[i]);
        }
        let [mut x, mut z, mut alpha] = [[0.0; LANES]; 3];
        for i in 0..LANES {
            let moments = LobeMoments::at(positions[i]);
            (x[i], z[i], alpha[i]) = (moments.x, moments.z, moments.alpha);
        }
        let mut directions = [[0.0; LANES]; 3];
        for i in 0..LANES {
            let n = vec3(&self.n, i);
            let away = (n * cos[i] - vec3(&self.v, i)).normalize_or(Vec3::ZERO);
            set3(&mut directions, i, (away * x[i] + n * z[i]).normalize_or(n).to_array());
        }
        (directions, alpha)
    }
}
