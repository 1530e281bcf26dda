//! Environments averaged over reflected lobes, as one lookup: prefiltered maps of GGX at normal incidence (Karis, “Real
//! Shading in Unreal Engine 4”, 2013).

use std::f32::consts::PI;

use glam::Vec3;

use super::kernel::Kernel;
use super::octahedral::to_square;
use super::pyramid::Level;
use super::{Environment, EnvironmentMap, PREFILTERED_MAPS, log2};
use crate::geometry::Rgb;

/// Texels on a side of the maps for α = 1, 1/2, 1/4, 1/8 and 1/16: two or more over the width of the lobe.
const SIDES: [usize; PREFILTERED_MAPS] = [8, 16, 16, 32, 64];

impl Environment {
    /// Returns the radiance averaged over the lobe that a GGX surface of roughness `alpha` reflects around the unit direction
    /// `d`, seen from there. It is continuous in both.
    #[inline]
    pub fn prefiltered(&self, d: Vec3, alpha: f32) -> Rgb {
        match &self.map {
            None => self.radiance,
            Some(map) => map.prefiltered(self.to_map * d, alpha) * self.radiance,
        }
    }
}

impl EnvironmentMap {
    #[inline]
    fn prefiltered(&self, d: Vec3, alpha: f32) -> Rgb {
        let octave = -log2(alpha.clamp(1e-6, 1.0));
        let octave = octave.max(0.0);
        let first = octave as usize;
        let t = octave - first as f32;
        let p = to_square(d);
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
