//! Blurred environments, as backgrounds show them.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{Environment, EnvironmentMap, Pyramid};
use crate::geometry::{Rgb, golden_angle};

/// Directions that are averaged for each texel.
const DIRECTIONS: u32 = 128;
/// Solid angle of a lookup over that which its direction stands for: neighbouring lookups overlap.
const FILTER_WIDTH: f64 = 2.0;
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

/// A map blurred by a width in radians.
#[derive(Clone)]
pub(super) struct BlurredMap {
    width: f64,
    map: Arc<EnvironmentMap>,
}

impl EnvironmentMap {
    fn blur(&self, width: f64) -> Arc<EnvironmentMap> {
        let side = (SIDE_TIMES_WIDTH / width).clamp(*SIDES.start(), *SIDES.end());
        let side = 1 << (side as u32).ilog2();
        let kernel = Kernel::new(1.0 / (width * width));
        let pyramid = Pyramid::new(side, 1, |d| kernel.mean(self, d));
        Arc::new(EnvironmentMap::new(None, pyramid))
    }
}

/// The directions of a blur around +Z, each with the solid angle of its lookup in steradians.
struct Kernel(Vec<(DVec3, f32)>);

impl Kernel {
    /// Spreads directions of equal weight by steps of the golden angle.
    fn new(kappa: f64) -> Kernel {
        // The distribution function of cos θ is (e^(κ (cos θ − 1)) − e^(−2κ)) / (1 − e^(−2κ)).
        let tail = libm::exp(-2.0 * kappa);
        let direction = |i: u32| {
            let u = (f64::from(i) + 0.5) / f64::from(DIRECTIONS);
            let density = tail + u * (1.0 - tail);
            let cos = (1.0 + libm::log(density) / kappa).clamp(-1.0, 1.0);
            let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
            let [cos_around, sin_around] = golden_angle(i, 0.0);
            // The density in the middle is κ / 2π (1 − e^(−2κ)).
            let covered = TAU * (1.0 - tail) / (kappa * density);
            let solid_angle = (FILTER_WIDTH * covered / f64::from(DIRECTIONS)) as f32;
            (DVec3::new(sin * cos_around, sin * sin_around, cos), solid_angle)
        };
        Kernel((0..DIRECTIONS).map(direction).collect())
    }

    fn mean(&self, map: &EnvironmentMap, d: Vec3) -> Rgb {
        let z = d.as_dvec3().normalize();
        // The axes turn with the direction, so that neighbouring texels average neighbouring directions.
        let x = DVec3::Y.cross(z).try_normalize().unwrap_or(DVec3::X);
        let y = z.cross(x);
        let lookup = |(l, solid_angle): &(DVec3, f32)| {
            let l = x * l.x + y * l.y + z * l.z;
            map.radiance(l.as_vec3(), *solid_angle)
        };
        self.0.iter().map(lookup).sum::<Rgb>() / DIRECTIONS as f32
    }
}
