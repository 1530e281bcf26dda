//! Environments averaged over reflected lobes, as one lookup: prefiltered maps of GGX at normal incidence (Karis, “Real
//! Shading in Unreal Engine 4”, 2013).

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::kernel::Kernel;
use super::octahedral::to_square;
use super::pyramid::Level;
use super::{Environment, EnvironmentMap, PREFILTERED_MAPS, log2};
use crate::geometry::Rgb;

/// Texels on a side of the maps for α = 1, 1/2, 1/4, 1/8 and 1/16: two or more over the width of the lobe.
const SIDES: [usize; PREFILTERED_MAPS] = [8, 16, 16, 32, 64];

impl Environment {
    /// Returns the radiance averaged over lobes: those that a GGX surface of roughness `alpha` reflects around the unit
    /// direction `d`, seen from there. It is continuous in both. `d` and `alpha` are structure of arrays.
    #[inline(always)]
    pub(crate) fn prefiltered<const N: usize>(&self, d: &[[f32; N]; 3], alpha: &[f32; N]) -> [Rgb; N] {
        let Some(map) = &self.map else { return [self.radiance; N] };
        let mut lookups = [PrefilteredLookup::default(); N];
        for i in 0..N {
            let d = self.to_map * Vec3::new(d[0][i], d[1][i], d[2][i]);
            lookups[i] = PrefilteredLookup { d, p: to_square(d), alpha: alpha[i], octave: octave(alpha[i]) };
        }
        let mut radiance = [Rgb::ZERO; N];
        for (radiance, lookup) in radiance.iter_mut().zip(&lookups) {
            *radiance = map.prefiltered(lookup) * self.radiance;
        }
        radiance
    }
}

/// A lookup of a prefiltered map.
#[derive(Clone, Copy, Default)]
struct PrefilteredLookup {
    /// Unit direction in the frame of the map.
    d: Vec3,
    /// The point of the direction in the unit square.
    p: Vec2,
    alpha: f32,
    octave: f32,
}

/// −log₂ α, at least 0.
#[inline(always)]
fn octave(alpha: f32) -> f32 {
    (-log2(alpha.clamp(1e-6, 1.0))).max(0.0)
}

impl EnvironmentMap {
    #[inline(always)]
    fn prefiltered(&self, lookup: &PrefilteredLookup) -> Rgb {
        let &PrefilteredLookup { d, p, alpha, octave } = lookup;
        let first = octave as usize;
        let t = octave - first as f32;
        let at = |i: usize| {
            if i < SIDES.len() {
                self.prefiltered_level(i).radiance(p.x, p.y).truncate()
            } else {
                // Narrow lobes are about as wide as the solid angle of their density's maximum.
                self.radiance(d, 4.0 * PI * alpha * alpha)
            }
        };
        if first >= SIDES.len() || t == 0.0 { at(first) } else { at(first).lerp(at(first + 1), t) }
    }

    #[inline]
    fn prefiltered_level(&self, i: usize) -> &Level {
        // Not in parallel: threads would wait for each other inside of other work.
        self.prefiltered[i].get_or_init(|| {
            let kernel = Kernel::ggx(1.0 / f64::from(1 << i));
            Level::from_function(SIDES[i], |d| kernel.mean(self, d))
        })
    }
}
