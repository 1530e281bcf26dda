//! 3D lookup tables (LUTs) over the logarithm of light, with tetrahedral interpolation.
//!
//! The range is that of AgX in Blender 5.0's `config.ocio`.

use std::sync::OnceLock;

use crate::display::batch::{BATCH, RgbBatch, split};

/// log2 of the light at both ends of an axis, as used by lookups.
pub(super) const LOG2: [f32; 2] = [-12.473_93, 12.526_069];

/// A function of linear light, sampled at N logarithmic steps of each channel.
pub(super) struct Lut3d<const N: usize> {
    function: fn([f64; 3]) -> [f64; 3],
    /// Light of each node along an axis.
    axis: [f64; N],
    /// Computed on first use: a picture needs few of them.
    nodes: Vec<OnceLock<[f32; 3]>>,
}

impl<const N: usize> Lut3d<N> {
    const STEPS_PER_STOP: f32 = (N - 1) as f32 / (LOG2[1] - LOG2[0]);
    /// Index distance between neighbouring nodes along red, green and blue.
    const STRIDES: [usize; 3] = [N * N, N, 1];

    pub(super) fn new(function: fn([f64; 3]) -> [f64; 3], axis: [f64; N]) -> Lut3d<N> {
        let nodes = std::iter::repeat_with(OnceLock::new).take(N.pow(3)).collect();
        Lut3d { function, axis, nodes }
    }

    #[inline(always)]
    fn node(&self, index: usize) -> &[f32; 3] {
        let node = &self.nodes[index];
        node.get().unwrap_or_else(|| self.compute(index))
    }

    #[cold]
    #[inline(never)]
    fn compute(&self, index: usize) -> &[f32; 3] {
        let light = || Self::STRIDES.map(|stride| self.axis[index / stride % N]);
        self.nodes[index].get_or_init(|| (self.function)(light()).map(|v| v as f32))
    }

    /// Evaluates the interpolated function for a batch. NaN counts as 0.
    ///
    /// Tetrahedral interpolation: walks from the lowest corner of a cell to its highest, along the axes
    /// in order of decreasing fraction.
    #[inline(always)]
    pub(super) fn at(&self, light: &RgbBatch) -> RgbBatch {
        let strides = Self::STRIDES.map(|stride| stride as u32);
        let mut weights = [[0.0; BATCH]; 3];
        let mut corners = [[0; BATCH]; 4];
        for i in 0..BATCH {
            let position = |c: usize| split(Self::axis_position(light[c][i]), (N - 2) as f32);
            let [(red, r), (green, g), (blue, b)] = [position(0), position(1), position(2)];
            let max = r.max(g).max(b);
            let min = r.min(g).min(b);
            weights[0][i] = max;
            weights[1][i] = r.min(g).max(r.max(g).min(b));
            weights[2][i] = min;
            let not_red = if g == max { strides[1] } else { strides[2] };
            let first = if r == max { strides[0] } else { not_red };
            let not_blue = if g == min { strides[1] } else { strides[0] };
            let last = if b == min { strides[2] } else { not_blue };
            let low = red * strides[0] + green * strides[1] + blue;
            let high = low + strides[0] + strides[1] + strides[2];
            corners[0][i] = low;
            corners[1][i] = low + first;
            corners[2][i] = high - last;
            corners[3][i] = high;
        }
        let mut nodes = [[[0.0; BATCH]; 3]; 4];
        for (nodes, corners) in nodes.iter_mut().zip(corners) {
            for (i, corner) in corners.into_iter().enumerate() {
                let &[r, g, b] = self.node(corner as usize);
                nodes[0][i] = r;
                nodes[1][i] = g;
                nodes[2][i] = b;
            }
        }
        let mut out = nodes[0];
        for (k, weights) in weights.iter().enumerate() {
            for (c, out) in out.iter_mut().enumerate() {
                for i in 0..BATCH {
                    out[i] += weights[i] * (nodes[k + 1][c][i] - nodes[k][c][i]);
                }
            }
        }
        out
    }

    /// Returns the position of `light` along an axis, in nodes.
    #[inline(always)]
    fn axis_position(light: f32) -> f32 {
        // `max` turns NaN into the smallest light.
        let steps = (log2(light.max(f32::MIN_POSITIVE)) - LOG2[0]) * Self::STEPS_PER_STOP;
        steps.clamp(0.0, (N - 1) as f32)
    }
}

/// Returns log2 of a positive normal number, with an absolute error of 2e-7 plus 1e-7 relative.
/// Branch-free, so that loops vectorise, and identical on every machine.
#[inline(always)]
pub(super) fn log2(v: f32) -> f32 {
    // v = m·2^e with m in √½…√2; s = (m − 1)/(m + 1), and ln m = 2 artanh s.
    const SQRT_HALF: i32 = 0x3f35_04f3;
    let bits = v.to_bits() as i32;
    let e = bits.wrapping_sub(SQRT_HALF) >> 23;
    let m = f32::from_bits(bits.wrapping_sub(e << 23) as u32);
    let s = (m - 1.0) / (m + 1.0);
    let z = s * s;
    let artanh = 1.0 + z * (1.0 / 3.0 + z * (1.0 / 5.0 + z * (1.0 / 7.0 + z * (1.0 / 9.0))));
    e as f32 + s * (2.0 * std::f32::consts::LOG2_E) * artanh
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODES: usize = 57;

    #[test]
    fn log2_is_within_its_bound() {
        for i in 0..=0xff_u32 {
            for j in 0..512 {
                let v = f32::from_bits(i << 23 | j << 14);
                if v.is_normal() && v > 0.0 {
                    let exact = libm::log2(f64::from(v));
                    let error = (f64::from(log2(v)) - exact).abs();
                    assert!(error <= 2e-7 + 1e-7 * exact.abs(), "{v}: {} {exact}", log2(v));
                }
            }
        }
        assert_eq!(log2(f32::INFINITY), 128.0);
    }

    /// The interpolation reproduces linear functions everywhere, whichever axis comes first.
    #[test]
    fn linear_functions_are_interpolated_exactly() {
        let step = f64::from(LOG2[1] - LOG2[0]) / (NODES - 1) as f64;
        let linear = |c: [f64; 3]| {
            let [r, g, b] = c.map(libm::log2);
            [r + 2.0 * g - b, g - 3.0 * r, b]
        };
        let axis: [f64; NODES] = std::array::from_fn(|i| libm::exp2(f64::from(LOG2[0]) + step * i as f64));
        let lut = Lut3d::new(linear, axis);
        for i in 0..4096u32 {
            let light = [0, 4, 8].map(|shift| 0.013 * 1.37f32.powi((i >> shift & 15) as i32));
            let exact = linear(light.map(f64::from));
            let ours = lut.at(&light.map(|v| [v; BATCH]));
            for c in 0..3 {
                assert!(
                    (f64::from(ours[c][3]) - exact[c]).abs() < 1e-4,
                    "{light:?}: {ours:?}, not {exact:?}"
                );
            }
        }
    }
}
