//! Diffuse environment lighting by spherical harmonics.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

use super::panorama::Panorama;
use super::pyramid::Pyramid;
use blinn_core::geometry::Rgb;

/// The irradiance of an environment as nine spherical harmonics. The irradiance of a surface differs
/// from the exact one by 1 % on average, and by at most 9 % for a single point of light (Ramamoorthi
/// and Hanrahan, “An Efficient Representation for Irradiance Environment Maps”, SIGGRAPH 2001).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SkyIrradiance {
    /// Coefficients of 1; x, y, z; xy, yz, zx, 3y² − 1, x² − z².
    coefficients: [DVec3; 9],
    /// From the world to the frame of the harmonics.
    to_map: DMat3,
}

/// Norms of the harmonics, in the same order.
const NORMS: [f64; 9] = [
    0.282_094_791_773_878_14,
    0.488_602_511_902_919_9,
    0.488_602_511_902_919_9,
    0.488_602_511_902_919_9,
    1.092_548_430_592_079_2,
    1.092_548_430_592_079_2,
    1.092_548_430_592_079_2,
    0.315_391_565_252_520_05,
    0.546_274_215_296_039_6,
];
/// Convolution of the harmonics with a clamped cosine, over π.
const COSINE_LOBE: [f64; 9] = [1.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0, 0.25, 0.25, 0.25, 0.25, 0.25];

/// Rows of an equirectangular picture whose sums are integrals to 0.01 %.
const MIN_ROWS: u32 = 128;

/// Texels on a side of the mip level that is projected: the harmonics have no detail that it lacks.
const PROJECTED_SIDE: usize = 128;

/// Returns the nine harmonics in the direction `d`, without their norms.
#[inline(always)]
fn harmonics(d: DVec3) -> [f64; 9] {
    let DVec3 { x, y, z } = d;
    [1.0, x, y, z, x * y, y * z, z * x, 3.0 * y * y - 1.0, x * x - z * z]
}

impl SkyIrradiance {
    /// Projects an equirectangular image. Rows go from straight up to straight down. The centre column
    /// faces +X, and columns to the right of it turn towards +Z, as in Blender and three.js. Negative and
    /// non-finite values count as black.
    pub fn from_equirectangular(width: u32, height: u32, pixel: impl Fn(u32, u32) -> Rgb) -> SkyIrradiance {
        let angle = |i: u32| TAU * ((f64::from(i) + 0.5) / f64::from(width) - 0.5);
        let columns: Vec<(f64, f64)> =
            (0..width).map(|i| (libm::cos(angle(i)), libm::sin(angle(i)))).collect();
        let mut sums = [DVec3::ZERO; 9];
        for j in 0..height {
            // Sums over the columns of a row, weighted by 1, cos, sin, cos 2a and sin 2a of the angle.
            let mut row = [DVec3::ZERO; 5];
            for (i, &(cos, sin)) in (0..width).zip(&columns) {
                let p =
                    pixel(i, j).to_array().map(|v| if v.is_finite() { f64::from(v.max(0.0)) } else { 0.0 });
                let p = DVec3::from(p);
                for (sum, k) in row.iter_mut().zip([1.0, cos, sin, cos * cos - sin * sin, 2.0 * cos * sin]) {
                    *sum += p * k;
                }
            }
            let edge = |j: f64| libm::cos(PI * j / f64::from(height));
            let (top, bottom) = (f64::from(j), f64::from(j) + 1.0);
            let solid_angle = TAU * (edge(top) - edge(bottom)) / f64::from(width);
            let (y, s) = (edge(top + 0.5), libm::sin(PI * (top + 0.5) / f64::from(height)));
            let [one, x, z, cos2, sin2] = row.map(|sum| sum * solid_angle);
            let harmonics = [
                one,
                x * s,
                one * y,
                z * s,
                x * (s * y),
                z * (s * y),
                sin2 * (0.5 * s * s),
                one * (3.0 * y * y - 1.0),
                cos2 * (s * s),
            ];
            for ((sum, h), norm) in sums.iter_mut().zip(harmonics).zip(NORMS) {
                *sum += h * norm;
            }
        }
        SkyIrradiance { coefficients: sums, to_map: DMat3::IDENTITY }
    }

    /// Projects a panorama. One of few rows is refined first: its texels are wider than the harmonics' detail.
    pub fn from_panorama(panorama: &Panorama) -> SkyIrradiance {
        let (width, height) = (panorama.width(), panorama.height());
        let refinement = MIN_ROWS.div_ceil(height);
        if refinement == 1 {
            return SkyIrradiance::from_equirectangular(width, height, |x, y| panorama.texel(x, y));
        }
        let (columns, rows) = (width.saturating_mul(refinement).max(2 * MIN_ROWS), height * refinement);
        let radiance = |i: u32, j: u32| {
            let around = TAU * ((f64::from(i) + 0.5) / f64::from(columns) - 0.5);
            let down = PI * (f64::from(j) + 0.5) / f64::from(rows);
            let (y, s) = (libm::cos(down), libm::sin(down));
            panorama.radiance(DVec3::new(s * libm::cos(around), y, s * libm::sin(around)).as_vec3())
        };
        SkyIrradiance::from_equirectangular(columns, rows, radiance)
    }

    /// Projects a mip pyramid.
    pub(super) fn from_pyramid(pyramid: &Pyramid) -> SkyIrradiance {
        let mut coefficients = [DVec3::ZERO; 9];
        pyramid.for_each_texel(PROJECTED_SIDE, |d, radiance, solid_angle| {
            for ((sum, h), norm) in coefficients.iter_mut().zip(harmonics(d)).zip(NORMS) {
                *sum += radiance.as_dvec3() * (h * norm * solid_angle);
            }
        });
        SkyIrradiance { coefficients, to_map: DMat3::IDENTITY }
    }

    /// Makes the irradiance of the same radiance in all directions.
    pub fn uniform(radiance: Rgb) -> SkyIrradiance {
        let mut coefficients = [DVec3::ZERO; 9];
        coefficients[0] = radiance.as_dvec3() * (4.0 * PI * NORMS[0]);
        SkyIrradiance { coefficients, to_map: DMat3::IDENTITY }
    }

    /// Makes the irradiance from coefficients of the radiance in the order of this type: 1; x, y, z; xy, yz, zx,
    /// 3y² − 1, x² − z², each of unit norm.
    pub fn from_coefficients(coefficients: [DVec3; 9]) -> SkyIrradiance {
        SkyIrradiance { coefficients, to_map: DMat3::IDENTITY }
    }

    /// Makes the irradiance from coefficients of the irradiance itself in the usual order of the harmonics, whose pole is
    /// z: 1; y, z, x; xy, yz, 3z² − 1, xz, x² − y², each of unit norm.
    pub fn from_irradiance(e: [DVec3; 9]) -> SkyIrradiance {
        let half_sqrt_3 = 0.5 * 3f64.sqrt();
        // The same functions with the pole y.
        let pole = -0.5 * e[6] - half_sqrt_3 * e[8];
        let across = -half_sqrt_3 * e[6] + 0.5 * e[8];
        let mut coefficients = [e[0], e[3], e[1], e[2], e[4], e[5], e[7], pole, across];
        for (c, cosine) in coefficients.iter_mut().zip(COSINE_LOBE) {
            *c /= PI * cosine;
        }
        SkyIrradiance { coefficients, to_map: DMat3::IDENTITY }
    }

    /// Returns the irradiance multiplied by `factor`.
    pub(super) fn scaled(mut self, factor: Rgb) -> SkyIrradiance {
        if factor != Rgb::ONE {
            self.coefficients = self.coefficients.map(|c| c * factor.as_dvec3());
        }
        self
    }

    /// Returns the irradiance of the same environment, which a rotation `to_map` takes from the world to its frame.
    pub(super) fn rotated(self, to_map: DMat3) -> SkyIrradiance {
        SkyIrradiance { to_map: self.to_map * to_map, ..self }
    }

    /// Returns I_a for a surface with unit normal `n`: its irradiance over π. For a constant environment
    /// that is its radiance.
    #[inline(always)]
    pub fn ambient(&self, n: DVec3) -> Rgb {
        let harmonics = harmonics(self.to_map * n);
        let mut sum = DVec3::ZERO;
        for (((c, h), norm), cosine) in self.coefficients.iter().zip(harmonics).zip(NORMS).zip(COSINE_LOBE) {
            sum += *c * (h * norm * cosine);
        }
        sum.max(DVec3::ZERO).as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normals() -> impl Iterator<Item = DVec3> {
        let all =
            [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1], [3, -2, 1], [-1, 4, 2]];
        all.into_iter().map(|n| DVec3::from(n.map(f64::from)).normalize())
    }

    #[test]
    fn a_constant_sky_gives_its_radiance() {
        let sky = SkyIrradiance::from_equirectangular(64, 32, |_, _| Rgb::new(0.25, 1.0, 3.0));
        for n in normals() {
            assert!(sky.ambient(n).abs_diff_eq(Rgb::new(0.25, 1.0, 3.0), 1e-2), "{n}: {}", sky.ambient(n));
        }
    }

    #[test]
    fn a_panorama_of_few_texels_gives_its_radiance() {
        for (width, height) in [(1, 1), (2, 1), (1, 2), (4, 2), (6, 3), (5, 2), (64, 32), (200, 127)] {
            let texels = vec![[0.5; 3]; (width * height) as usize];
            let sky = SkyIrradiance::from_panorama(&Panorama::new(width, height, texels).unwrap());
            for n in normals() {
                assert!((sky.ambient(n).x - 0.5).abs() < 5e-4, "{width}x{height} {n}: {}", sky.ambient(n));
            }
        }
    }

    #[test]
    fn a_panorama_of_few_texels_keeps_its_sides() {
        // White around +X, black around −X, and white above, black below.
        for (width, height, texels, bright) in [
            (4, 2, [0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0], DVec3::X),
            (4, 2, [1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0], DVec3::Y),
        ] {
            let texels = texels.iter().map(|v| [*v; 3]).collect();
            let sky = SkyIrradiance::from_panorama(&Panorama::new(width, height, texels).unwrap());
            let (light, dark) = (sky.ambient(bright).x, sky.ambient(-bright).x);
            assert!((light + dark - 1.0).abs() < 2e-3 && light > 0.8, "{bright}: {light} {dark}");
        }
    }

    #[test]
    fn a_first_order_sky_is_exact() {
        // L = 1 + 0.8 y + 0.5 x: the cosine scales first-order harmonics by 2/3.
        let at = |i: u32, j: u32| {
            let (a, b) = (TAU * ((f64::from(i) + 0.5) / 512.0 - 0.5), PI * (f64::from(j) + 0.5) / 256.0);
            Rgb::splat((1.0 + 0.8 * b.cos() + 0.5 * b.sin() * a.cos()) as f32)
        };
        let sky = SkyIrradiance::from_equirectangular(512, 256, at);
        for n in normals() {
            let expected = 1.0 + (0.8 * n.y + 0.5 * n.x) * 2.0 / 3.0;
            assert!((f64::from(sky.ambient(n).x) - expected).abs() < 1e-3, "{n}");
        }
    }

    #[test]
    fn the_centre_column_faces_x_and_its_right_z() {
        let spot = |column: u32, row: u32| {
            let sky = SkyIrradiance::from_equirectangular(64, 32, |i, j| {
                if i.abs_diff(column) <= 1 && j.abs_diff(row) <= 1 { Rgb::ONE } else { Rgb::ZERO }
            });
            let light = |n: &DVec3| sky.ambient(*n).x;
            normals().take(6).max_by(|a, b| light(a).total_cmp(&light(b))).unwrap()
        };
        assert_eq!(spot(32, 16), DVec3::X);
        assert_eq!(spot(48, 16), DVec3::Z);
        assert_eq!(spot(16, 16), DVec3::NEG_Z);
        assert_eq!((spot(20, 1), spot(20, 30)), (DVec3::Y, DVec3::NEG_Y));
    }

    /// The irradiance max(0, n·l) of a light from a direction, projected numerically.
    #[test]
    fn irradiance_coefficients_have_their_pole_at_z() {
        let sky = SkyIrradiance::from_equirectangular(256, 128, |i, j| {
            Rgb::splat(if (40..60).contains(&i) && (20..50).contains(&j) { 3.0 } else { 0.1 })
        });
        let mut e = [DVec3::ZERO; 9];
        let count = 20_000;
        for i in 0..count {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count);
            let angle = f64::from(i) * 2.399_963;
            let r = (1.0 - z * z).sqrt();
            let n = DVec3::new(r * angle.cos(), r * angle.sin(), z);
            let irradiance = sky.ambient(n).as_dvec3() * PI * (4.0 * PI / f64::from(count));
            let DVec3 { x, y, z } = n;
            let h = [1.0, y, z, x, x * y, y * z, 3.0 * z * z - 1.0, x * z, x * x - y * y];
            let norms = [0, 1, 1, 1, 4, 4, 7, 4, 8].map(|i| NORMS[i]);
            for ((e, h), norm) in e.iter_mut().zip(h).zip(norms) {
                *e += irradiance * (h * norm);
            }
        }
        let same = SkyIrradiance::from_irradiance(e);
        for n in normals() {
            assert!(same.ambient(n).abs_diff_eq(sky.ambient(n), 1e-3), "{n}");
        }
    }

    #[test]
    fn invalid_pixels_are_black() {
        let sky = SkyIrradiance::from_equirectangular(8, 4, |i, _| {
            Rgb::new([f32::NAN, f32::INFINITY, -5.0][i as usize % 3], 0.0, 0.0)
        });
        assert_eq!(sky.ambient(DVec3::Y), Rgb::ZERO);
    }
}
