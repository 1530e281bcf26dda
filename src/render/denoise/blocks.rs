//! A fit for each block of 4 × 4 pixels, for light that is smooth: cheaper, and with less noise of its own, than a fit for
//! each pixel (as the collaborative regression of NFOR).

use blinn_core::geometry::Rgb;
use blinn_core::simd::{AutovecKernel, SimdLevel};

use super::coarse::Coarse;
use super::linear_fit::{LANES, Lane, NormalEquations, load};
use super::params::Params;
use super::pixels::offsets;
use super::similarity::{ComputeWeights, Scratch};
use super::window::{Rect, Window};

/// Returns the light of a tile: each pixel is the weighted mean of the fits of all blocks in reach.
///
/// The fit of a block is around its centre. Pixels count for the mean as they count for the fit.
pub(super) fn fit(fine: &Window, params: &Params, simd: SimdLevel, tile: Rect) -> Vec<Rgb> {
    let coarse = Coarse::new(fine);
    let window = &coarse.window;
    let centers = window.block_centers(coarse.cells(tile).expand(params.radius), params.step);
    let (columns, rows) = (centers.width.div_ceil(params.step), centers.height.div_ceil(params.step));
    let offsets = offsets(params.radius);
    // For each block, the weights of its neighbours: LANES more, so that a row can be loaded at once.
    let row = (2 * params.radius + 1).next_multiple_of(LANES);
    let size = row * (2 * params.radius + 1);
    let mut weights = vec![0.0; size * columns * rows];
    let mut scratch = Scratch::default();
    let mut plane = vec![0.0; centers.area()];
    for (k, offset) in offsets.iter().enumerate() {
        if *offset == [0, 0] {
            plane.fill(1.0);
        } else {
            let (scratch, out) = (&mut scratch, &mut plane);
            simd.run(ComputeWeights { window, params, rect: centers, offset: *offset, scratch, out });
        }
        let k = k / (2 * params.radius + 1) * row + k % (2 * params.radius + 1);
        for y in 0..rows {
            for x in 0..columns {
                let weight = plane[y * params.step * centers.width + x * params.step];
                weights[(y * columns + x) * size + k] = weight;
            }
        }
    }
    let center =
        |x: usize, y: usize| [centers.x + (x * params.step) as isize, centers.y + (y * params.step) as isize];
    let centers: Vec<[isize; 2]> = (0..rows).flat_map(|y| (0..columns).map(move |x| center(x, y))).collect();
    let mut sums = vec![[0.0; 4]; tile.area()];
    let (coarse, centers, weights, sums_out) = (&coarse, &centers, &weights, &mut sums);
    if params.occlusion {
        simd.run(FitBlocks::<9> { fine, coarse, params, tile, row, centers, weights, sums: sums_out });
    } else {
        simd.run(FitBlocks::<7> { fine, coarse, params, tile, row, centers, weights, sums: sums_out });
    }
    let mean = |([r, g, b, weight], mean): (&[f32; 4], Rgb)| {
        if *weight > 1e-5 { (Rgb::new(*r, *g, *b) / *weight).max(Rgb::ZERO) } else { mean }
    };
    sums.iter().zip(fine.means(tile)).map(mean).collect()
}

struct FitBlocks<'a, const N: usize> {
    fine: &'a Window,
    coarse: &'a Coarse,
    params: &'a Params,
    tile: Rect,
    /// Number of weights of a row of neighbours.
    row: usize,
    /// Cells in the middle of the blocks.
    centers: &'a [[isize; 2]],
    /// For each block, the weights of its neighbours.
    weights: &'a [f32],
    /// For each pixel of the tile, light times weight, and weight.
    sums: &'a mut [[f32; 4]],
}

impl<const N: usize> AutovecKernel for FitBlocks<'_, N> {
    #[inline(always)]
    fn run(self) {
        let FitBlocks { fine, coarse, params, tile, row, centers, weights, sums } = self;
        let window = &coarse.window;
        let side = 2 * params.radius + 1;
        let r = params.radius as isize;
        for (center, weights) in centers.iter().zip(weights.chunks_exact(row * side)) {
            let p = window.index(center[0], center[1]);
            let mut f0 = [0.0; N];
            for i in 1..N {
                f0[i] = window.features[i - 1][p];
            }
            let mut equations = NormalEquations::<N>::new();
            for (j, weights) in weights.chunks_exact(row).enumerate() {
                let start = window.index(center[0] - r, center[1] - r + j as isize);
                for (k, w) in weights.chunks_exact(LANES).enumerate() {
                    let q = start + k * LANES;
                    let counts = load(&window.weight, q);
                    let mut w: Lane = load(w, 0);
                    for l in 0..LANES {
                        w[l] *= counts[l];
                    }
                    let f = features::<N>(window, q, &f0);
                    let color = [0, 1, 2].map(|c| load(&window.light[c], q));
                    equations.add(&[w], &[f], &[color]);
                }
            }
            equations.sum_lanes();
            if equations.total()[0] <= 0.0 {
                continue;
            }
            let solution = equations.solve(params);
            let mut fit = [[0.0f32; 3]; N];
            for i in 0..N {
                fit[i] = [0, 1, 2].map(|c| solution[i][c][0] as f32);
            }
            let first = coarse.first_pixel([center[0] - r, center[1] - r]);
            for (j, weights) in weights.chunks_exact(row).enumerate() {
                for y in first[1] + 2 * j as isize..first[1] + 2 * j as isize + 2 {
                    if y < tile.y || y >= tile.y + tile.height as isize {
                        continue;
                    }
                    for (k, w) in weights.chunks_exact(LANES / 2).enumerate() {
                        let x = first[0] + (k * LANES) as isize;
                        let q = fine.index(x, y);
                        let f = features::<N>(fine, q, &f0);
                        let mut value = [[0.0; LANES]; 3];
                        for c in 0..3 {
                            for i in 0..N {
                                for l in 0..LANES {
                                    value[c][l] += fit[i][c] * f[i][l];
                                }
                            }
                        }
                        for l in 0..LANES {
                            let x = x + l as isize;
                            let w = w[l / 2];
                            if w > 1e-5 && x >= tile.x && x < tile.x + tile.width as isize {
                                let i = (y - tile.y) as usize * tile.width + (x - tile.x) as usize;
                                let sum = &mut sums[i];
                                for c in 0..3 {
                                    sum[c] += w * value[c][l];
                                }
                                sum[3] += w;
                            }
                        }
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn features<const N: usize>(window: &Window, q: usize, center: &[f32; N]) -> [Lane; N] {
    let mut f = [[1.0; LANES]; N];
    for i in 1..N {
        f[i] = load(&window.features[i - 1], q);
        for l in 0..LANES {
            f[i][l] -= center[i];
        }
    }
    f
}
