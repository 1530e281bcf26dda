//! A fit for each pixel.

use blinn_core::geometry::Rgb;
use blinn_core::simd::{AutovecKernel, SimdLevel};

use super::linear_fit::{LANES, NormalEquations, load};
use super::params::Params;
use super::similarity::{ComputeWeights, Scratch};
use super::window::{Rect, Window};

/// Returns the light of a tile, each pixel by a fit to its neighbours.
pub(super) fn fit(window: &Window, params: &Params, simd: SimdLevel, tile: Rect) -> Vec<Rgb> {
    let offsets = offsets(params.radius);
    let mut weights = vec![0.0; tile.area() * offsets.len()];
    let mut scratch = Scratch::default();
    // A pixel counts as much as the neighbour most like it, so that an outlier does not stand alone.
    let mut most = vec![1e-4; tile.area()];
    for (offset, out) in offsets.iter().zip(weights.chunks_exact_mut(tile.area())) {
        if *offset != [0, 0] {
            simd.run(ComputeWeights {
                window,
                params,
                rect: tile,
                offset: *offset,
                scratch: &mut scratch,
                out,
            });
            for (most, w) in most.iter_mut().zip(&*out) {
                *most = if *w > *most { *w } else { *most };
            }
        }
    }
    weights[offsets.len() / 2 * tile.area()..][..tile.area()].copy_from_slice(&most);
    let mut out = window.means(tile);
    if params.albedo {
        simd.run(FitPixels::<10> {
            window,
            params,
            tile,
            offsets: &offsets,
            weights: &weights,
            out: &mut out,
        });
    } else {
        simd.run(FitPixels::<7> {
            window,
            params,
            tile,
            offsets: &offsets,
            weights: &weights,
            out: &mut out,
        });
    }
    out
}

/// Offsets of all neighbours, row by row.
pub(super) fn offsets(radius: usize) -> Vec<[isize; 2]> {
    let r = radius as isize;
    (-r..=r).flat_map(|y| (-r..=r).map(move |x| [x, y])).collect()
}

/// Neighbours that are added at once.
const BATCH: usize = 4;

struct FitPixels<'a, const N: usize> {
    window: &'a Window,
    params: &'a Params,
    tile: Rect,
    offsets: &'a [[isize; 2]],
    /// For each offset, the weights of all pixels.
    weights: &'a [f32],
    out: &'a mut [Rgb],
}

impl<const N: usize> AutovecKernel for FitPixels<'_, N> {
    #[inline(always)]
    fn run(self) {
        let FitPixels { window, params, tile, offsets, weights, out } = self;
        let stride = window.rect.width as isize;
        for y in 0..tile.height {
            for x in (0..tile.width).step_by(LANES) {
                let lanes = LANES.min(tile.width - x);
                let p = window.index(tile.x + x as isize, tile.y + y as isize);
                let mut center = [[0.0; LANES]; N];
                for i in 1..N {
                    center[i] = load(&window.features[i - 1], p);
                }
                let mut equations = NormalEquations::<N>::new();
                // Neighbours without weight in any lane are left out.
                let mut count = 0;
                let mut w = [[0.0; LANES]; BATCH];
                let mut f = [[[1.0; LANES]; N]; BATCH];
                let mut color = [[[0.0; LANES]; 3]; BATCH];
                for (k, [dx, dy]) in offsets.iter().enumerate() {
                    let q = (p as isize + dy * stride + dx) as usize;
                    let from = &weights[k * tile.area() + y * tile.width + x..][..lanes];
                    w[count] = [0.0; LANES];
                    w[count][..lanes].copy_from_slice(from);
                    let counts = load(&window.weight, q);
                    for l in 0..LANES {
                        w[count][l] *= counts[l];
                    }
                    if w[count] == [0.0; LANES] {
                        continue;
                    }
                    for i in 1..N {
                        let feature = load(&window.features[i - 1], q);
                        for l in 0..LANES {
                            f[count][i][l] = feature[l] - center[i][l];
                        }
                    }
                    for c in 0..3 {
                        color[count][c] = load(&window.light[c], q);
                    }
                    count += 1;
                    if count == BATCH {
                        equations.add(&w, &f, &color);
                        count = 0;
                    }
                }
                w[count..].fill([0.0; LANES]);
                equations.add(&w, &f, &color);
                let solution = equations.solve(params);
                for l in 0..lanes {
                    let color = Rgb::from_array([0, 1, 2].map(|c| solution[0][c][l] as f32));
                    if equations.total()[l] > 0.0 && color.is_finite() {
                        out[y * tile.width + x + l] = color.max(Rgb::ZERO);
                    }
                }
            }
        }
    }
}
