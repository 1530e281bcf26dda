//! The mean light of texels whose encoded colours are interpolated, computed in SIMD lanes.

use crate::texture::srgb::DecodeTable;
use crate::texture::texels::{Channels, MIN_ALPHA_WEIGHT, TexelView};
use blinn_core::simd::{AutovecKernel, SimdLevel};

/// Texels that are computed side by side.
const LANES: usize = 16;

/// A texel's row in a plane of [`StoredRows`], with those above and below it.
type Rows<'a> = [&'a [f32]; 3];

/// The mean light over each texel of some rows of an image, interpolated in its encoding.
pub(super) struct InterpolatedLight {
    /// One plane for each channel of the means.
    planes: Vec<Vec<f32>>,
    stride: usize,
}

impl InterpolatedLight {
    /// Computes `count` rows from `first` on. Colours are weighted by the alpha at each point if they are `alpha_weighted`.
    pub fn of_rows(image: TexelView, first: usize, count: usize, alpha_weighted: bool) -> InterpolatedLight {
        let stored = StoredRows::new(image, first, count, alpha_weighted);
        let stride = stored.stride - 2;
        let table = DecodeTable::get();
        let simd = SimdLevel::detect();
        let alpha = stored.alpha;
        let means = |plane: usize| {
            let mut means = vec![0.0; count * stride];
            for (y, means) in means.chunks_exact_mut(stride).enumerate() {
                let rows = stored.around(plane, y);
                let table = (Some(plane) != alpha).then_some(table);
                let weights = alpha.filter(|&alpha| plane != alpha && alpha_weighted);
                let weights = weights.map(|alpha| stored.around(alpha, y));
                simd.run(MeanLight { rows, table, weights, means });
            }
            means
        };
        InterpolatedLight { planes: (0..stored.planes.len()).map(means).collect(), stride }
    }

    /// Computes the means over 2 × 2 texels each, from the pair `i` of rows.
    pub fn compute_quads(&self, i: usize, quads: &mut [f32]) {
        let channels = self.planes.len();
        for (channel, plane) in self.planes.iter().enumerate() {
            let (above, below) = plane[2 * i * self.stride..].split_at(self.stride);
            let pairs = above.as_chunks::<2>().0.iter().zip(below.as_chunks::<2>().0);
            for (quad, (above, below)) in quads.iter_mut().skip(channel).step_by(channels).zip(pairs) {
                *quad = (above[0] + above[1] + below[0] + below[1]) * 0.25;
            }
        }
    }

    /// Returns the means of row `y` of those that were asked for, with their channels interleaved.
    pub fn row(&self, y: usize, width: usize) -> Vec<f32> {
        let channels = self.planes.len();
        let mut row = vec![0.0; width * channels];
        for (channel, plane) in self.planes.iter().enumerate() {
            let means = &plane[y * self.stride..];
            for (to, mean) in row.iter_mut().skip(channel).step_by(channels).zip(means) {
                *to = *mean;
            }
        }
        row
    }
}

/// Rows of an image as stored, a plane for each channel, with one more row above and below and one more texel at either end,
/// wrapped around. Rows are padded for [`LANES`].
struct StoredRows {
    planes: Vec<Vec<f32>>,
    /// Index of the plane of alpha.
    alpha: Option<usize>,
    stride: usize,
}

impl StoredRows {
    /// Reads `count` rows from `first` on. Alpha that is missing is 1, if there is a need for it.
    fn new(image: TexelView, first: usize, count: usize, needs_alpha: bool) -> StoredRows {
        let (w, h) = (image.width as usize, image.height as usize);
        let stride = w.next_multiple_of(LANES) + 2;
        let colors = match image.channels {
            Channels::L | Channels::La => 1,
            Channels::Rgb | Channels::Rgba => 3,
        };
        let alpha = (needs_alpha || image.channels as usize > colors).then_some(colors);
        let mut planes = vec![vec![1.0; (count + 2) * stride]; colors + usize::from(alpha.is_some())];
        for (k, y) in (first + h - 1..first + h + count + 1).enumerate() {
            let start = k * stride;
            for (channel, plane) in planes.iter_mut().take(image.channels as usize).enumerate() {
                let row = y % h * w..(y % h + 1) * w;
                image.copy_channel(row, channel, &mut plane[start + 1..][..w]);
                plane[start] = plane[start + w];
                plane[start + w + 1] = plane[start + 1];
            }
        }
        StoredRows { planes, alpha, stride }
    }

    /// Returns row `y` of those that were asked for, between its neighbours.
    fn around(&self, plane: usize, y: usize) -> Rows<'_> {
        [0, 1, 2].map(|k| &self.planes[plane][(y + k) * self.stride..][..self.stride])
    }
}

/// Computes a row of means by Gauss–Legendre quadrature with two points along each axis between texel centres.
struct MeanLight<'a> {
    rows: Rows<'a>,
    /// Decodes colours; `None` for alpha.
    table: Option<&'a DecodeTable>,
    /// The alphas that colours are weighted by.
    weights: Option<Rows<'a>>,
    /// As many as the rows have, without their ends.
    means: &'a mut [f32],
}

impl AutovecKernel for MeanLight<'_> {
    #[inline(always)]
    fn run(self) {
        let (chunks, _) = self.means.as_chunks_mut::<LANES>();
        for (i, means) in chunks.iter_mut().enumerate() {
            let mut sum = [0.0; LANES];
            for dx in [0, 2] {
                for dy in [0, 2] {
                    let mut light = interpolate(&self.rows, i * LANES, dx, dy);
                    if let Some(table) = self.table {
                        light = table.decode(&light);
                    }
                    if let Some(weights) = &self.weights {
                        let alpha = interpolate(weights, i * LANES, dx, dy);
                        for (light, alpha) in light.iter_mut().zip(alpha) {
                            *light *= alpha + MIN_ALPHA_WEIGHT;
                        }
                    }
                    for (sum, light) in sum.iter_mut().zip(light) {
                        *sum += light;
                    }
                }
            }
            *means = sum.map(|sum| sum * 0.25);
        }
    }
}

/// Interpolates at the points of some texels from `start` on that are next to column `dx` and row `dy` of the three around
/// them.
#[inline(always)]
fn interpolate(rows: &Rows, start: usize, dx: usize, dy: usize) -> [f32; LANES] {
    const NEAR: f32 = 0.788_675_1;
    const FAR: f32 = 1.0 - NEAR;
    let lanes = |row: usize, column: usize| -> [f32; LANES] {
        rows[row][start + column..].first_chunk().copied().unwrap_or_default()
    };
    let (centre, corner) = (lanes(1, 1), lanes(dy, dx));
    let (beside, above) = (lanes(1, dx), lanes(dy, 1));
    let mut out = [0.0; LANES];
    for (i, out) in out.iter_mut().enumerate() {
        let sides = beside[i] + above[i];
        *out = centre[i] * (NEAR * NEAR) + sides * (NEAR * FAR) + corner[i] * (FAR * FAR);
    }
    out
}
