//! Means of 2 × 2 vectors of an 8-bit normal map, in SIMD lanes: the first mip level of most normal maps.

use glam::Vec4;

use crate::texture::texels::{Channels, TexelView, Texels};
use blinn_core::simd::{AutovecKernel, SimdLevel};

const LANES: usize = 16;

/// An 8-bit normal map of even size.
pub(super) struct NormalQuads<'a> {
    bytes: &'a [u8],
    width: usize,
    has_alpha: bool,
}

impl<'a> NormalQuads<'a> {
    /// Takes an image of even width and height. Returns `None` for other texels.
    pub fn new(image: TexelView<'a>) -> Option<NormalQuads<'a>> {
        let Texels::U8(bytes) = image.texels else { return None };
        let has_alpha = match image.channels {
            Channels::L | Channels::La => return None,
            Channels::Rgb => false,
            Channels::Rgba => true,
        };
        Some(NormalQuads { bytes, width: image.width as usize, has_alpha })
    }

    /// Computes the means of row `y` of the level.
    pub fn compute_row(&self, y: usize, row: &mut [Vec4]) {
        if self.has_alpha { self.means::<4>(y, row) } else { self.means::<3>(y, row) }
    }

    fn means<const CHANNELS: usize>(&self, y: usize, row: &mut [Vec4]) {
        let (texels, _) = self.bytes.as_chunks::<CHANNELS>();
        let pairs = |y: usize| texels[y * self.width..][..self.width].as_chunks::<2>().0.chunks(LANES);
        let simd = SimdLevel::detect();
        for (row, (above, below)) in row.chunks_mut(LANES).zip(pairs(2 * y).zip(pairs(2 * y + 1))) {
            let mut means = [[0.0; LANES]; 3];
            simd.run(MeanNormals { rows: [above, below], means: &mut means });
            let [x, y, z] = means;
            for (i, mean) in row.iter_mut().enumerate() {
                *mean = Vec4::new(x[i], y[i], z[i], 0.0);
            }
        }
    }
}

/// Computes the means of at most [`LANES`] pairs of neighbouring texels in two rows.
struct MeanNormals<'a, const CHANNELS: usize> {
    rows: [&'a [[[u8; CHANNELS]; 2]]; 2],
    means: &'a mut [[f32; LANES]; 3],
}

impl<const CHANNELS: usize> AutovecKernel for MeanNormals<'_, CHANNELS> {
    #[inline(always)]
    fn run(self) {
        let mut sum = [[0.0; LANES]; 3];
        for pairs in self.rows {
            for side in 0..2 {
                let normals = unit_vectors(pairs, side);
                for (sum, normals) in sum.iter_mut().zip(&normals) {
                    for (sum, n) in sum.iter_mut().zip(normals) {
                        *sum += n * 0.25;
                    }
                }
            }
        }
        *self.means = sum;
    }
}

/// Decodes one texel of each pair to a vector of length 1, or 0 if it has no direction.
#[inline(always)]
fn unit_vectors<const CHANNELS: usize>(pairs: &[[[u8; CHANNELS]; 2]], side: usize) -> [[f32; LANES]; 3] {
    let mut stored = [[0u8; LANES]; 3];
    for (i, pair) in pairs.iter().enumerate().take(LANES) {
        for axis in 0..3 {
            stored[axis][i] = pair[side][axis];
        }
    }
    let mut v = [[0.0; LANES]; 3];
    for (v, stored) in v.iter_mut().zip(&stored) {
        for (v, stored) in v.iter_mut().zip(stored) {
            *v = f32::from(*stored) / 255.0 * 2.0 - 1.0;
        }
    }
    let [x, y, z] = &mut v;
    for i in 0..LANES {
        let length = (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).sqrt();
        // Lengths of vectors of bytes are never 0.
        let scale = 1.0 / length;
        x[i] *= scale;
        y[i] *= scale;
        z[i] *= scale;
    }
    v
}

#[cfg(test)]
mod tests {
    #[test]
    fn no_byte_is_zero() {
        assert!((0..=255u8).all(|byte| f32::from(byte) / 255.0 * 2.0 - 1.0 != 0.0));
    }
}
