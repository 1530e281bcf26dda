//! Blurred environments, as backgrounds show them.

use std::sync::Arc;

use rayon::prelude::*;

use super::kernel::Kernel;
use super::pyramid::texel_directions;
use super::{BlurredMap, Environment, EnvironmentMap, Pyramid};
use blinn_core::geometry::Rgb;
use blinn_core::simd::SimdLevel;

/// Texels on a side of the finest mip level of a blurred environment.
const SIDES: std::ops::RangeInclusive<f64> = 32.0..=512.0;
/// Texels on a side for a blur of 1 radian: texels are narrower than the blur.
const SIDE_TIMES_WIDTH: f64 = 24.0;
/// Least width of a blur in radians. Less is sharp.
const MIN_WIDTH: f64 = 1e-3;

impl Environment {
    /// Returns the environment averaged around each direction with the weights exp(κ (cos θ − 1)) of a von Mises–Fisher
    /// distribution, which is a Gaussian on the sphere. Its standard deviation is `blur`² radians: about as blurred as the
    /// reflection of a surface of that roughness. 0 returns it as it is.
    pub fn blurred(&self, blur: f32) -> Environment {
        let width = f64::from(blur) * f64::from(blur);
        let Some(map) = self.map.as_ref().filter(|_| width >= MIN_WIDTH) else { return self.clone() };
        // Computed without a lock, because it is parallel: threads must not wait for each other inside of other work.
        let known = map.blurred.get().filter(|blurred| blurred.width == width);
        let blurred = known.cloned().unwrap_or_else(|| {
            let blurred = BlurredMap { width, map: map.blur(width) };
            // The scenes of a batch share the first one.
            let _ = map.blurred.set(blurred.clone());
            blurred
        });
        Environment { map: Some(blurred.map), ..self.clone() }
    }
}

impl EnvironmentMap {
    fn blur(&self, width: f64) -> Arc<EnvironmentMap> {
        let side = (SIDE_TIMES_WIDTH / width).clamp(*SIDES.start(), *SIDES.end());
        let side = 1 << (side as u32).ilog2();
        let kernel = Kernel::von_mises_fisher(1.0 / (width * width));
        let directions = texel_directions(side);
        let simd = SimdLevel::detect();
        let rows = directions.par_chunks(side).map(|row| kernel.means(simd, self, row));
        let texels: Vec<Rgb> = rows.flatten_iter().collect();
        let pyramid = Pyramid::from_texels(&texels, side);
        Arc::new(EnvironmentMap::new(None, pyramid))
    }
}
