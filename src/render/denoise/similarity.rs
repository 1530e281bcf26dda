//! Weights of neighbours by non-local means (Rousselle, Knaus and Zwicker, “Adaptive Rendering with Non-Local Means
//! Filtering”, 2012).

use blinn_core::simd::AutovecKernel;

use super::params::{Params, SMOOTHING};
use super::window::{Rect, Window};

/// Scratch memory of weights.
#[derive(Default)]
pub(super) struct Scratch {
    distance: Vec<f32>,
    rows: Vec<f32>,
    weight: Vec<f32>,
}

/// Computes how much the pixel `offset` away counts for each pixel of `rect`.
pub(super) struct ComputeWeights<'a> {
    pub window: &'a Window,
    pub params: &'a Params,
    pub rect: Rect,
    pub offset: [isize; 2],
    pub scratch: &'a mut Scratch,
    pub out: &'a mut [f32],
}

impl AutovecKernel for ComputeWeights<'_> {
    #[inline(always)]
    fn run(self) {
        let ComputeWeights { window, params, rect, offset, scratch, out } = self;
        let patch = params.patch;
        let wide = rect.expand(SMOOTHING);
        let raw = wide.expand(patch);
        let k2 = params.tolerance * params.tolerance;
        let shift = offset[1] * window.rect.width as isize + offset[0];
        scratch.distance.resize(raw.area(), 0.0);
        scratch.rows.resize(wide.width * raw.height, 0.0);
        scratch.weight.resize(wide.area(), 0.0);
        let side = 2 * patch + 1;
        for y in 0..raw.height {
            let row = &mut scratch.distance[y * raw.width..][..raw.width];
            row.fill(0.0);
            let start = window.index(raw.x, raw.y + y as isize);
            let shifted = (start as isize + shift) as usize;
            for c in 0..3 {
                let n = raw.width;
                let (light, variance) = (&window.light[c], &window.variance[c]);
                let (p, q) = (&light[start..start + n], &light[shifted..shifted + n]);
                let (vp, vq) = (&variance[start..start + n], &variance[shifted..shifted + n]);
                let row = &mut row[..n];
                for x in 0..n {
                    let d = p[x] - q[x];
                    let expected = vp[x] + if vp[x] < vq[x] { vp[x] } else { vq[x] };
                    row[x] += (d * d - expected) / (k2 * (vp[x] + vq[x]));
                }
            }
            let to = &mut scratch.rows[y * wide.width..][..wide.width];
            to.fill(0.0);
            for k in 0..side {
                let from = &row[k..k + to.len()];
                for x in 0..to.len() {
                    to[x] += from[x];
                }
            }
        }
        // A distance of 8 or more has weight 0.
        let scale = 1.0 / (8.0 * 3.0 * (side * side) as f32);
        for y in 0..wide.height {
            let to = &mut scratch.weight[y * wide.width..][..wide.width];
            to.fill(0.0);
            for k in 0..side {
                let from = &scratch.rows[(y + k) * wide.width..][..to.len()];
                for x in 0..to.len() {
                    to[x] += from[x];
                }
            }
            for x in to.iter_mut() {
                *x = exp_minus_8(*x * scale);
            }
        }
        for y in 0..rect.height {
            let to = &mut out[y * rect.width..][..rect.width];
            to.fill(0.0);
            for k in 0..(2 * SMOOTHING + 1) * (2 * SMOOTHING + 1) {
                let (i, j) = (k % (2 * SMOOTHING + 1), k / (2 * SMOOTHING + 1));
                let from = &scratch.weight[(y + j) * wide.width + i..][..to.len()];
                for x in 0..to.len() {
                    to[x] += from[x];
                }
            }
            for x in to.iter_mut() {
                *x *= 1.0 / 9.0;
            }
        }
    }
}

/// Approximates e^(−8 x) for x ≥ 0 by (1 − x)⁸. It is 1 below 0, and 0 from 0.95 on, so that none is subnormal.
#[inline(always)]
fn exp_minus_8(x: f32) -> f32 {
    let y = 1.0 - x;
    let y = if y < 1.0 { y } else { 1.0 };
    let y = if y > 0.05 { y } else { 0.0 };
    let y2 = y * y;
    let y4 = y2 * y2;
    y4 * y4
}
