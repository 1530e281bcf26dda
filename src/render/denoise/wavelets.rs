//! Smoothing of light by edge-avoiding à-trous wavelets (Dammertz, Sewtz, Hanika and Lensch, “Edge-Avoiding À-Trous
//! Wavelet Transform for fast Global Illumination Filtering”, 2010; with variance as in SVGF: Schied et al. 2017).
//!
//! Each level averages 5 × 5 pixels that lie twice as far apart as those of the level before. It is simpler and faster than
//! [`denoise`](super::denoise), and suits light that is smooth: reflections in rough metals, and what is out of focus.

use std::ops::Range;

use blinn_core::geometry::Rgb;
use blinn_core::simd::{AutovecKernel, SimdLevel};
use glam::Vec3;
use rayon::prelude::*;

use super::part::NoisyPart;

/// The one-dimensional kernel, a cubic B-spline, from its centre.
const KERNEL: [f32; 3] = [0.375, 0.25, 0.0625];
/// Pixels to each side over which variance is averaged.
const VARIANCE_RADIUS: usize = 2;

/// Normals count as equal up to this share of α: the width of the lobe.
const NORMAL_TOLERANCE: f32 = 1.0;
/// The same for mirrors.
const MIN_NORMAL_TOLERANCE: f32 = 0.01;
/// Squared sine of the angle to the tangent plane up to which positions count as equal.
const PLANE_TOLERANCE: f32 = 0.04;

/// Kinds of light that are smoothed differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SmoothKind {
    /// Light that rough surfaces reflect.
    RoughReflections,
    /// Light of surfaces that are out of focus.
    OutOfFocus,
}

impl SmoothKind {
    /// Distance of the pixels of each level.
    const fn steps(self) -> &'static [usize] {
        match self {
            SmoothKind::RoughReflections => &[1, 2, 4, 8],
            SmoothKind::OutOfFocus => &[1, 2, 4],
        }
    }

    /// Pixels to each side that the levels reach.
    const fn reach(self) -> usize {
        let (mut reach, mut level) = (0, 0);
        while level < self.steps().len() {
            reach += 2 * self.steps()[level];
            level += 1;
        }
        reach
    }

    /// Pixels to each side that a pixel depends on.
    pub const fn margin(self) -> usize {
        self.reach() + VARIANCE_RADIUS
    }

    /// Luminance counts as equal up to so many variances, by level. A few samples of a rough lobe, or of a blurred edge, see either
    /// this or that: the first level averages both.
    fn light_tolerance(self) -> [f32; 4] {
        match self {
            SmoothKind::RoughReflections => [200.0, 64.0, 32.0, 16.0],
            SmoothKind::OutOfFocus => [32.0, 8.0, 4.0, 4.0],
        }
    }

    /// Returns the mean of the channels as differences are measured: out-of-focus highlights from 0 to 1, so that a bright one
    /// does not spread.
    #[inline(always)]
    fn luminance(self, sum: f32) -> f32 {
        let mean = sum * (1.0 / 3.0);
        match self {
            SmoothKind::RoughReflections => mean,
            SmoothKind::OutOfFocus => mean / (1.0 + mean),
        }
    }
}

/// Greater differences count as this one: smaller weights than its 1e-8 would be lost, and lead to subnormal numbers.
const MAX_DIFFERENCE: f32 = 100.0;
/// Smaller heights over the tangent plane are rounding errors, and their squares subnormal numbers.
const MIN_HEIGHT: f32 = 1e-15;

/// Noisy light, in pixels, row by row from the top.
pub(crate) struct WaveletLight {
    pub kind: SmoothKind,
    /// Width in pixels.
    pub width: usize,
    /// Means of the even and of the odd samples; reflections are divided by the reflecting colour.
    pub halves: [Vec<Rgb>; 2],
    /// Samples per pixel.
    pub samples: u32,
    /// True for pixels that are smoothed.
    pub is_noisy: Vec<bool>,
    /// Mean shading normals.
    pub normal: Vec<Vec3>,
    /// Mean positions.
    pub position: Vec<Vec3>,
    /// Mean GGX α.
    pub alpha: Vec<f32>,
}

/// Bytes for each pixel that [`smooth_light`] takes, those of [`WaveletLight`] included.
pub(crate) const WAVELET_PIXEL: u64 = 120;

/// Smooths the light of `rows`, and returns it from the first of them on. Pixels that are not smoothed keep theirs.
///
/// The result has the same bits for any number of threads and at any SIMD level.
pub(crate) fn smooth_light(light: &WaveletLight, simd: SimdLevel, rows: Range<usize>) -> Vec<Rgb> {
    let width = light.width;
    let guides = Guides::new(light);
    let mut planes = Planes::new(light);
    let height = guides.height;
    let mut reach = light.kind.reach();
    for (&step, tolerance) in light.kind.steps().iter().zip(light.kind.light_tolerance()) {
        reach -= 2 * step;
        let needed = rows.start.saturating_sub(reach)..(rows.end + reach).min(height);
        let smooth = |y: usize| {
            guides.has_noisy[y].then(|| {
                let mut row: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; width]);
                simd.run(SmoothRow {
                    kind: light.kind,
                    guides: &guides,
                    planes: &planes,
                    y,
                    step,
                    tolerance,
                    width,
                    out: &mut row,
                });
                row
            })
        };
        let smoothed: Vec<Option<[Vec<f32>; 4]>> = needed.clone().into_par_iter().map(smooth).collect();
        for (y, row) in needed.zip(smoothed) {
            let Some([r, g, b, variance]) = row else { continue };
            let at = guides.index(0, y);
            for (plane, row) in planes.light.iter_mut().zip([r, g, b]) {
                plane[at..at + width].copy_from_slice(&row);
            }
            planes.variance[at..at + width].copy_from_slice(&variance);
        }
    }
    let pixel = |i: usize| {
        let at = guides.index(i % width, i / width);
        Rgb::new(planes.light[0][at], planes.light[1][at], planes.light[2][at])
    };
    (rows.start * width..rows.end * width).map(pixel).collect()
}

/// Pixels beside each row, with weight 0: taps need no bounds.
const PADDING: usize = 16;

/// Surface attributes that decide which pixels are alike, in planes with [`PADDING`].
struct Guides {
    height: usize,
    /// Width of the planes.
    stride: usize,
    /// 1 for a pixel that is smoothed, else 0.
    weight: Vec<f32>,
    normal: [Vec<f32>; 3],
    position: [Vec<f32>; 3],
    /// 1 over the squared tolerance of normals.
    sharpness: Vec<f32>,
    /// True for rows with such pixels.
    has_noisy: Vec<bool>,
}

impl Guides {
    fn new(light: &WaveletLight) -> Guides {
        let width = light.width;
        let height = light.normal.len() / width.max(1);
        let padded = |value: &(dyn Fn(usize) -> f32 + Sync)| plane(width, height, value);
        let axis = |of: &[Vec3], axis: usize| padded(&|i| of[i][axis]);
        let sharpness = |i: usize| {
            let tolerance = NORMAL_TOLERANCE * light.alpha[i] + MIN_NORMAL_TOLERANCE;
            1.0 / (tolerance * tolerance)
        };
        Guides {
            height,
            stride: width + 2 * PADDING,
            weight: padded(&|i| f32::from(light.is_noisy[i])),
            normal: [0, 1, 2].map(|c| axis(&light.normal, c)),
            position: [0, 1, 2].map(|c| axis(&light.position, c)),
            sharpness: padded(&sharpness),
            has_noisy: light.is_noisy.chunks(width.max(1)).map(|row| row.contains(&true)).collect(),
        }
    }

    fn index(&self, x: usize, y: usize) -> usize {
        y * self.stride + PADDING + x
    }
}

fn plane(width: usize, height: usize, value: &(dyn Fn(usize) -> f32 + Sync)) -> Vec<f32> {
    let mut plane = vec![0.0; (width + 2 * PADDING) * height];
    plane.par_chunks_exact_mut(width + 2 * PADDING).enumerate().for_each(|(y, row)| {
        for (x, to) in row[PADDING..PADDING + width].iter_mut().enumerate() {
            *to = value(y * width + x);
        }
    });
    plane
}

/// Light and the variance of its luminance.
struct Planes {
    light: [Vec<f32>; 3],
    variance: Vec<f32>,
}

impl Planes {
    fn new(light: &WaveletLight) -> Planes {
        let width = light.width;
        let height = light.normal.len() / width.max(1);
        let [even, odd] = NoisyPart::shares(light.samples);
        let mean = |i: usize| light.halves[0][i] * even + light.halves[1][i] * odd;
        let difference = |i: usize| {
            if !light.is_noisy[i] {
                return [0.0; 2];
            }
            let d = match light.kind {
                SmoothKind::RoughReflections => {
                    (light.halves[0][i] - light.halves[1][i]).element_sum() * (1.0 / 6.0)
                }
                kind @ SmoothKind::OutOfFocus => {
                    let [a, b] = [0, 1].map(|half| kind.luminance(light.halves[half][i].element_sum()));
                    0.5 * (a - b)
                }
            };
            [d * d, 1.0]
        };
        // Two halves tell little of the variance: its mean over the pixels around does.
        let raw: Vec<[f32; 2]> = (0..width * height).into_par_iter().map(difference).collect();
        let by_row: Vec<[f32; 2]> = (0..width * height)
            .into_par_iter()
            .map(|i| sum_around(i % width, width, |x| raw[i - i % width + x]))
            .collect();
        let variance = |i: usize| {
            let [sum, count] = sum_around(i / width, height, |y| by_row[y * width + i % width]);
            sum / count.max(1.0)
        };
        Planes {
            light: [0, 1, 2].map(|c| plane(width, height, &|i| mean(i)[c])),
            variance: plane(width, height, &variance),
        }
    }
}

/// The sum of the values within [`VARIANCE_RADIUS`] of `at`, of `len` in all.
fn sum_around(at: usize, len: usize, value: impl Fn(usize) -> [f32; 2]) -> [f32; 2] {
    let range = at.saturating_sub(VARIANCE_RADIUS)..(at + VARIANCE_RADIUS + 1).min(len);
    range.map(value).fold([0.0; 2], |sum, [a, b]| [sum[0] + a, sum[1] + b])
}

/// Smooths a row of pixels.
struct SmoothRow<'a> {
    kind: SmoothKind,
    guides: &'a Guides,
    planes: &'a Planes,
    y: usize,
    step: usize,
    /// Tolerance of differences of light, in variances.
    tolerance: f32,
    width: usize,
    /// Red, green, blue and variance.
    out: &'a mut [Vec<f32>; 4],
}

impl AutovecKernel for SmoothRow<'_> {
    #[inline(always)]
    fn run(self) {
        let SmoothRow { kind, guides, planes, y, step, tolerance, width: n, out } = self;
        let [r, g, b, variance] = out;
        let [r, g, b, variance] = [r, g, b, variance].map(|row| &mut row[..n]);
        let mut weights = vec![0.0f32; n];
        let p = guides.index(0, y);
        fn at(planes: &[Vec<f32>; 3], from: usize, n: usize) -> [&[f32]; 3] {
            planes.each_ref().map(|plane| &plane[from..from + n])
        }
        let ([nx, ny, nz], [px, py, pz]) = (at(&guides.normal, p, n), at(&guides.position, p, n));
        let (sharpness, noisy) = (&guides.sharpness[p..p + n], &guides.weight[p..p + n]);
        let ([lr, lg, lb], v) = (at(&planes.light, p, n), &planes.variance[p..p + n]);
        for dy in 0..5usize {
            let Some(row) = (y + dy * step).checked_sub(2 * step).filter(|row| *row < guides.height) else {
                continue;
            };
            for dx in 0..5usize {
                let q = guides.index(0, row) + dx * step - 2 * step;
                let kernel = KERNEL[dx.abs_diff(2)] * KERNEL[dy.abs_diff(2)];
                let ([mx, my, mz], [qx, qy, qz]) = (at(&guides.normal, q, n), at(&guides.position, q, n));
                let ([qr, qg, qb], qv) = (at(&planes.light, q, n), &planes.variance[q..q + n]);
                let weight = &guides.weight[q..q + n];
                for x in 0..n {
                    let (ax, ay, az) = (nx[x] - mx[x], ny[x] - my[x], nz[x] - mz[x]);
                    let of_normals = (ax * ax + ay * ay + az * az) * sharpness[x];
                    let (bx, by, bz) = (qx[x] - px[x], qy[x] - py[x], qz[x] - pz[x]);
                    let height = bx * nx[x] + by * ny[x] + bz * nz[x];
                    let height = if height.abs() < MIN_HEIGHT { 0.0 } else { height };
                    let distance2 = bx * bx + by * by + bz * bz;
                    let of_planes = height * height / (PLANE_TOLERANCE * distance2 + 1e-30);
                    let d = match kind {
                        SmoothKind::RoughReflections => {
                            (lr[x] + lg[x] + lb[x] - qr[x] - qg[x] - qb[x]) * (1.0 / 3.0)
                        }
                        SmoothKind::OutOfFocus => {
                            kind.luminance(lr[x] + lg[x] + lb[x]) - kind.luminance(qr[x] + qg[x] + qb[x])
                        }
                    };
                    let of_light = d * d / (tolerance * v[x] + 1e-12);
                    let fade = 1.0 / (1.0 + (of_normals + of_planes + of_light).min(MAX_DIFFERENCE));
                    let fade2 = fade * fade;
                    let w = kernel * weight[x] * (fade2 * fade2);
                    weights[x] += w;
                    r[x] += w * qr[x];
                    g[x] += w * qg[x];
                    b[x] += w * qb[x];
                    variance[x] += w * w * qv[x];
                }
            }
        }
        for x in 0..n {
            // Only the pixel's own weight is sure to count.
            let is_smoothed = noisy[x] > 0.0 && weights[x] > 0.0;
            let scale = if is_smoothed { 1.0 / weights[x] } else { 1.0 };
            r[x] = if is_smoothed { r[x] * scale } else { lr[x] };
            g[x] = if is_smoothed { g[x] * scale } else { lg[x] };
            b[x] = if is_smoothed { b[x] * scale } else { lb[x] };
            variance[x] = if is_smoothed { variance[x] * (scale * scale) } else { v[x] };
        }
    }
}
