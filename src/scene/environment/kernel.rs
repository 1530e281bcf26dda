//! Weighted directions around an axis, which average an environment.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::EnvironmentMap;
use blinn_core::geometry::{Rgb, golden_angle};
use blinn_core::simd::{AutovecKernel, SimdLevel};

/// Directions of a blur.
const BLUR_DIRECTIONS: u32 = 128;
/// Solid angle of a lookup over that which its direction stands for: neighbouring lookups of a blur overlap.
const BLUR_FILTER_WIDTH: f64 = 2.0;
/// Directions of a reflected lobe.
const LOBE_DIRECTIONS: u32 = 64;
/// Lookups are filtered a little wider than asked, between texels and between levels.
const LOBE_FILTER_WIDTH: f64 = 0.7;

/// Averages that are computed side by side.
const LANES: usize = 16;

/// A direction around +Z.
struct Lookup {
    l: DVec3,
    /// Solid angle of the lookup in steradians.
    solid_angle: f32,
    /// All weights together are 1.
    weight: f32,
}

/// The directions of an average around +Z.
pub(super) struct Kernel(Vec<Lookup>);

impl Kernel {
    /// Returns the density exp(κ (cos θ − 1)) of a von Mises–Fisher distribution, which is a Gaussian on the sphere.
    pub fn von_mises_fisher(kappa: f64) -> Kernel {
        // The distribution function of cos θ is (e^(κ (cos θ − 1)) − e^(−2κ)) / (1 − e^(−2κ)).
        let tail = libm::exp(-2.0 * kappa);
        let count = f64::from(BLUR_DIRECTIONS);
        let lookup = |i: u32| {
            let u = (f64::from(i) + 0.5) / count;
            let density = tail + u * (1.0 - tail);
            let cos = (1.0 + libm::log(density) / kappa).clamp(-1.0, 1.0);
            // The density in the middle is κ / 2π (1 − e^(−2κ)).
            let covered = TAU * (1.0 - tail) / (kappa * density);
            let solid_angle = (BLUR_FILTER_WIDTH * covered / count) as f32;
            Lookup { l: direction(i, cos), solid_angle, weight: (1.0 / count) as f32 }
        };
        Kernel((0..BLUR_DIRECTIONS).map(lookup).collect())
    }

    /// Returns the directions that a GGX surface of roughness `alpha` reflects to a viewer straight above it, weighted by
    /// Smith's shadowing.
    pub fn ggx(alpha: f64) -> Kernel {
        let (a2, count) = (alpha * alpha, f64::from(LOBE_DIRECTIONS));
        let lookup = |i: u32| {
            let u = (f64::from(i) + 0.5) / count;
            // Visible normals h from straight above: tan² θ = α² u / (1 − u).
            let cos2_h = (1.0 - u) / (1.0 - u + a2 * u);
            let cos = 2.0 * cos2_h - 1.0;
            let d = 1.0 - cos2_h + a2 * cos2_h;
            let pdf = a2 / (4.0 * PI * d * d);
            let tan2 = (1.0 - cos * cos) / (cos * cos);
            let shadowing = if cos > 0.0 { 2.0 / (1.0 + (1.0 + a2 * tan2).sqrt()) } else { 0.0 };
            let solid_angle = (LOBE_FILTER_WIDTH / (count * pdf)).min(TAU) as f32;
            Lookup { l: direction(i, cos), solid_angle, weight: shadowing as f32 }
        };
        let mut lookups: Vec<Lookup> = (0..LOBE_DIRECTIONS).map(lookup).filter(|l| l.weight > 0.0).collect();
        let total: f32 = lookups.iter().map(|l| l.weight).sum();
        lookups.iter_mut().for_each(|l| l.weight /= total);
        Kernel(lookups)
    }

    /// Returns the averages of a map around unit directions, the same at every SIMD level.
    pub fn means(&self, simd: SimdLevel, map: &EnvironmentMap, directions: &[Vec3]) -> Vec<Rgb> {
        let mut means = vec![Rgb::ZERO; directions.len()];
        simd.run(MeansKernel { lookups: &self.0, map, directions, means: &mut means });
        means
    }
}

/// [`Kernel::means`].
struct MeansKernel<'a> {
    lookups: &'a [Lookup],
    map: &'a EnvironmentMap,
    directions: &'a [Vec3],
    means: &'a mut [Rgb],
}

impl AutovecKernel for MeansKernel<'_> {
    #[inline(always)]
    fn run(self) {
        for (directions, means) in self.directions.chunks(LANES).zip(self.means.chunks_mut(LANES)) {
            let axes = AxesLanes::new(directions);
            for lookup in self.lookups {
                let radiance = self.map.radiance_of_lanes(&axes.to_world(lookup.l), lookup.solid_angle);
                for (mean, radiance) in means.iter_mut().zip(radiance) {
                    *mean += radiance * lookup.weight;
                }
            }
        }
    }
}

/// Axes of the directions around which averages are taken, in structure of arrays. Lanes without a direction are 0.
struct AxesLanes {
    x: [[f64; LANES]; 3],
    y: [[f64; LANES]; 3],
    z: [[f64; LANES]; 3],
}

impl AxesLanes {
    #[inline(always)]
    fn new(directions: &[Vec3]) -> AxesLanes {
        let [x, y, z] = [[[0.0; LANES]; 3]; 3];
        let mut axes = AxesLanes { x, y, z };
        for (i, d) in directions.iter().enumerate().take(LANES) {
            let z = d.as_dvec3().normalize();
            // The axes turn with the direction, so that neighbouring texels average neighbouring directions.
            let x = DVec3::Y.cross(z).try_normalize().unwrap_or(DVec3::X);
            let y = z.cross(x);
            for c in 0..3 {
                (axes.x[c][i], axes.y[c][i], axes.z[c][i]) = (x[c], y[c], z[c]);
            }
        }
        axes
    }

    /// The direction `l` of each lane's axes.
    #[inline(always)]
    fn to_world(&self, l: DVec3) -> [[f32; LANES]; 3] {
        let mut d = [[0.0; LANES]; 3];
        for c in 0..3 {
            for i in 0..LANES {
                d[c][i] = (self.x[c][i] * l.x + self.y[c][i] * l.y + self.z[c][i] * l.z) as f32;
            }
        }
        d
    }
}

/// Direction number `i` at cosine `cos` to +Z.
fn direction(i: u32, cos: f64) -> DVec3 {
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    let [cos_around, sin_around] = golden_angle(i, 0.0);
    DVec3::new(sin * cos_around, sin * sin_around, cos)
}
