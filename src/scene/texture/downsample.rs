//! Downsampling filters: the mean of each texel of a mip level over the finer level.

use std::ops::Range;

use glam::Vec4;

use crate::texture::texels::{Channels, MIN_ALPHA_WEIGHT};
use blinn_core::simd::{AutovecKernel, SimdLevel};

/// How a mip level is averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DownsampleFilter {
    /// The mean of linear light.
    Light { alpha_weighted: bool },
    /// The mean of the light that bilinear interpolation of *encoded* colours shows. It is darker than
    /// the mean of the texels, so that the first mip level is as bright as the interpolated image.
    EncodedBilinear { alpha_weighted: bool },
    /// The mean of data.
    Data,
    /// The mean of unit vectors. Levels hold its direction, and in alpha the root of how much shorter
    /// than 1 it is.
    Normals,
}

impl DownsampleFilter {
    /// Number of filters.
    pub const COUNT: usize = 6;

    /// Returns the filter's index, below [`DownsampleFilter::COUNT`].
    pub fn index(self) -> usize {
        match self {
            DownsampleFilter::Light { alpha_weighted } => usize::from(alpha_weighted),
            DownsampleFilter::EncodedBilinear { alpha_weighted } => 2 + usize::from(alpha_weighted),
            DownsampleFilter::Data => 4,
            DownsampleFilter::Normals => 5,
        }
    }

    /// Returns true if colours are weighted by alpha.
    pub fn is_alpha_weighted(self) -> bool {
        use DownsampleFilter::{EncodedBilinear, Light};
        matches!(self, Light { alpha_weighted: true } | EncodedBilinear { alpha_weighted: true })
    }

    /// Returns the number of channels of the means of an image. Weighted colours have their weight with
    /// them, vectors have no alpha.
    pub fn mean_channels(self, image: Channels) -> usize {
        match (self, image) {
            (DownsampleFilter::Normals, _) => 3,
            _ if self.is_alpha_weighted() => (image as usize).next_multiple_of(2),
            _ => image as usize,
        }
    }
}

/// Weights a colour by its alpha.
#[inline]
pub(super) fn weight_by_alpha(v: Vec4) -> Vec4 {
    (v.truncate() * (v.w + MIN_ALPHA_WEIGHT)).extend(v.w)
}

/// Divides a mean of weighted colours by its mean weight.
#[inline]
pub(super) fn unweight_by_alpha(v: Vec4) -> Vec4 {
    (v.truncate() / (v.w + MIN_ALPHA_WEIGHT)).extend(v.w)
}

/// Width and height of a level, in texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Size {
    pub width: usize,
    pub height: usize,
}

impl Size {
    /// Returns the size of the next smaller level.
    pub fn half(self) -> Size {
        Size { width: (self.width / 2).max(1), height: (self.height / 2).max(1) }
    }

    /// Returns true if each texel of the next smaller level covers 2 × 2 texels.
    pub fn is_even(self) -> bool {
        self.width.is_multiple_of(2) && self.height.is_multiple_of(2)
    }

    /// Returns the number of texels.
    pub fn texels(self) -> usize {
        self.width * self.height
    }
}

/// The step from a level to the next smaller one. Rows of means have their channels interleaved.
pub(super) struct Downsampling {
    fine: Size,
    /// Weights for each texel of a row and of a column of the smaller level. Empty for even sizes.
    across: Vec<[f32; 3]>,
    down: Vec<[f32; 3]>,
}

impl Downsampling {
    /// Prepares the step from a level of size `fine`.
    pub fn new(fine: Size) -> Downsampling {
        if fine.is_even() {
            return Downsampling { fine, across: Vec::new(), down: Vec::new() };
        }
        let half = fine.half();
        Downsampling {
            fine,
            across: weights(fine.width, half.width),
            down: weights(fine.height, half.height),
        }
    }

    /// Returns the rows of the larger level that row `y` of the smaller one covers.
    pub fn covered_rows(&self, y: usize) -> Range<usize> {
        2 * y..2 * y + covered(self.fine.height)
    }

    /// Computes row `y` of the smaller level. `fine` returns rows of the larger one.
    pub fn compute_row<'a>(
        &self,
        y: usize,
        channels: usize,
        fine: impl Fn(usize) -> &'a [f32],
        row: &mut [f32],
    ) {
        let simd = SimdLevel::detect();
        if self.fine.is_even() {
            simd.run(Halve { above: fine(2 * y), below: fine(2 * y + 1), channels, means: row });
            return;
        }
        row.fill(0.0);
        for (y, weight) in self.covered_rows(y).zip(self.down[y]) {
            let taps = covered(self.fine.width);
            simd.run(AddRow { fine: fine(y), weight, across: &self.across, taps, channels, sums: row });
        }
    }
}

/// Returns how many texels along a side a texel of the smaller level covers: one of a side of 1, two, or three of an odd
/// side, the outer ones in part.
fn covered(side: usize) -> usize {
    if side == 1 { 1 } else { 2 + side % 2 }
}

/// Returns the weights of the texels that each texel of the smaller side covers, from twice its index on.
fn weights(side: usize, half: usize) -> Vec<[f32; 3]> {
    let of_texel = |i| match covered(side) {
        1 => [1.0, 0.0, 0.0],
        2 => [0.5, 0.5, 0.0],
        // Texel i covers i·(2 + 1/half) to (i + 1)·(2 + 1/half).
        _ => [half - i, half, i + 1].map(|part| part as f32 / side as f32),
    };
    (0..half).map(of_texel).collect()
}

/// Computes the means of 2 × 2 texels of two rows.
pub(super) struct Halve<'a> {
    pub above: &'a [f32],
    pub below: &'a [f32],
    pub channels: usize,
    pub means: &'a mut [f32],
}

impl AutovecKernel for Halve<'_> {
    #[inline(always)]
    fn run(self) {
        match self.channels {
            1 => self.halve::<1>(),
            2 => self.halve::<2>(),
            3 => self.halve::<3>(),
            _ => self.halve::<4>(),
        }
    }
}

impl Halve<'_> {
    #[inline(always)]
    fn halve<const CHANNELS: usize>(self) {
        let pairs = |row| <[f32]>::as_chunks::<CHANNELS>(row).0.as_chunks::<2>().0;
        let (means, _) = self.means.as_chunks_mut::<CHANNELS>();
        for ((mean, above), below) in means.iter_mut().zip(pairs(self.above)).zip(pairs(self.below)) {
            for (c, mean) in mean.iter_mut().enumerate() {
                // A quarter of a float is exact.
                *mean = (above[0][c] + above[1][c] + below[0][c] + below[1][c]) * 0.25;
            }
        }
    }
}

/// Adds a weighted row to the sums of a row of the smaller level.
struct AddRow<'a> {
    fine: &'a [f32],
    weight: f32,
    across: &'a [[f32; 3]],
    /// Texels of the row that each sum covers.
    taps: usize,
    channels: usize,
    sums: &'a mut [f32],
}

impl AutovecKernel for AddRow<'_> {
    #[inline(always)]
    fn run(self) {
        match self.channels {
            1 => self.add_taps::<1>(),
            2 => self.add_taps::<2>(),
            3 => self.add_taps::<3>(),
            _ => self.add_taps::<4>(),
        }
    }
}

impl AddRow<'_> {
    #[inline(always)]
    fn add_taps<const CHANNELS: usize>(self) {
        match self.taps {
            1 => self.add::<CHANNELS, 1>(),
            2 => self.add::<CHANNELS, 2>(),
            _ => self.add::<CHANNELS, 3>(),
        }
    }

    #[inline(always)]
    fn add<const CHANNELS: usize, const TAPS: usize>(self) {
        let texels = self.fine.as_chunks::<CHANNELS>().0.windows(TAPS).step_by(2);
        let (sums, _) = self.sums.as_chunks_mut::<CHANNELS>();
        for ((sum, texels), weights) in sums.iter_mut().zip(texels).zip(self.across) {
            for (texel, weight) in texels.iter().zip(weights) {
                let weight = weight * self.weight;
                for (sum, v) in sum.iter_mut().zip(texel) {
                    *sum += v * weight;
                }
            }
        }
    }
}
