//! Environments averaged over reflected lobes, as one lookup: prefiltered maps of GGX at normal incidence (Karis, “Real
//! Shading in Unreal Engine 4”, 2013).

use std::f32::consts::PI;

use glam::Vec3;

use super::kernel::Kernel;
use super::octahedral::to_square;
use super::pyramid::{Level, TexelPosition, TexelPositions, texel_directions};
use super::{Environment, EnvironmentMap, PREFILTERED_MAPS, log2};
use blinn_core::geometry::Rgb;
use blinn_core::simd::SimdLevel;

/// Texels on a side of the maps for α = 1, 1/2, 1/4, 1/8 and 1/16: two or more over the width of the lobe.
const SIDES: [usize; PREFILTERED_MAPS] = [8, 16, 16, 32, 64];

impl Environment {
    /// Returns the radiance averaged over lobes: those that a GGX surface of roughness `alpha` reflects around the unit
    /// direction `d`, seen from there. It is continuous in both. `d` and `alpha` are structure of arrays.
    #[inline(always)]
    pub fn prefiltered<const N: usize>(&self, d: &[[f32; N]; 3], alpha: &[f32; N]) -> [Rgb; N] {
        let Some(map) = &self.map else { return [self.radiance; N] };
        let (mut first, mut t) = ([0; N], [0.0; N]);
        let [mut at_first, mut at_next] = [TexelPositions::<N>::ZERO; 2];
        for i in 0..N {
            let p = to_square(self.to_map * Vec3::new(d[0][i], d[1][i], d[2][i]));
            let octave = octave(alpha[i]);
            first[i] = octave as u32;
            t[i] = octave - first[i] as f32;
            at_first.set(i, TexelPosition::new(p, side(first[i])));
            at_next.set(i, TexelPosition::new(p, side(first[i] + 1)));
        }
        let mut radiance = [Rgb::ZERO; N];
        for i in 0..N {
            let at = |index: usize, position: TexelPosition| {
                if index < SIDES.len() {
                    map.prefiltered_level(index).at(position).truncate()
                } else {
                    // Narrow lobes are about as wide as the solid angle of their density's maximum.
                    let d = self.to_map * Vec3::new(d[0][i], d[1][i], d[2][i]);
                    map.radiance(d, 4.0 * PI * alpha[i] * alpha[i])
                }
            };
            let index = first[i] as usize;
            let mut mean = at(index, at_first.get(i));
            if index < SIDES.len() && t[i] != 0.0 {
                mean = mean.lerp(at(index + 1, at_next.get(i)), t[i]);
            }
            radiance[i] = mean * self.radiance;
        }
        radiance
    }
}

/// [`SIDES`] by index, without a table.
#[inline(always)]
fn side(map: u32) -> u32 {
    let mut side = SIDES[SIDES.len() - 1] as u32;
    for i in (0..SIDES.len() - 1).rev() {
        side = if map <= i as u32 { SIDES[i] as u32 } else { side };
    }
    side
}

/// −log₂ α, at least 0.
#[inline(always)]
fn octave(alpha: f32) -> f32 {
    (-log2(alpha.clamp(1e-6, 1.0))).max(0.0)
}

impl EnvironmentMap {
    #[inline]
    fn prefiltered_level(&self, i: usize) -> &Level {
        // Not in parallel: threads would wait for each other inside of other work.
        self.prefiltered[i].get_or_init(|| {
            let kernel = Kernel::ggx(1.0 / f64::from(1 << i));
            let means = kernel.means(SimdLevel::detect(), self, &texel_directions(SIDES[i]));
            Level::from_texels(&means, SIDES[i])
        })
    }
}
