//! Means of 2 × 2 vectors of an 8-bit normal map, in SIMD lanes: the first mip level of most normal maps.

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
    pub fn compute_row(&self, y: usize, row: &mut [f32]) {
        if self.has_alpha { self.means::<4>(y, row) } else { self.means::<3>(y, row) }
    }

    fn means<const CHANNELS: usize>(&self, y: usize, row: &mut [f32]) {
        let (texels, _) = self.bytes.as_chunks::<CHANNELS>();
        let pairs = |y: usize| texels[y * self.width..][..self.width].as_chunks::<2>().0.chunks(LANES);
        let simd = SimdLevel::detect();
        let (row, _) = row.as_chunks_mut::<3>();
        for (row, (above, below)) in row.chunks_mut(LANES).zip(pairs(2 * y).zip(pairs(2 * y + 1))) {
            let mut means = [[0.0; LANES]; 3];
            simd.run(MeanNormals { rows: [above, below], means: &mut means });
            let [x, y, z] = means;
            for (i, mean) in row.iter_mut().enumerate() {
                *mean = [x[i], y[i], z[i]];
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

/// Decodes row `y` of any image to vectors of length 1, or 0 if they have no direction.
pub(super) fn unit_vectors_of_row(image: TexelView, y: usize) -> Vec<f32> {
    let width = image.width as usize;
    let planes = [0, 1, 2].map(|axis| {
        let channel = if image.channels as usize >= 3 { axis } else { 0 };
        let mut plane = vec![0.0; width];
        image.copy_channel(y * width..(y + 1) * width, channel, &mut plane);
        plane
    });
    let mut vectors = vec![0.0; 3 * width];
    let planes = planes.each_ref().map(Vec::as_slice);
    SimdLevel::detect().run(UnitVectors { planes, vectors: &mut vectors });
    vectors
}

/// Decodes stored vectors, a plane for each axis.
struct UnitVectors<'a> {
    planes: [&'a [f32]; 3],
    vectors: &'a mut [f32],
}

impl AutovecKernel for UnitVectors<'_> {
    #[inline(always)]
    fn run(self) {
        let [x, y, z] = self.planes;
        let (vectors, _) = self.vectors.as_chunks_mut::<3>();
        for (to, ((x, y), z)) in vectors.iter_mut().zip(x.iter().zip(y).zip(z)) {
            let [x, y, z] = [x, y, z].map(|v| v * 2.0 - 1.0);
            let scale = 1.0 / (x * x + y * y + z * z).sqrt();
            let scale = if scale < f32::INFINITY { scale } else { 0.0 };
            *to = [x * scale, y * scale, z * scale];
        }
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn no_byte_is_zero() {
        assert!((0..=255u8).all(|byte| f32::from(byte) / 255.0 * 2.0 - 1.0 != 0.0));
    }
}
