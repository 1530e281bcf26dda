//! Downsampling filters: the mean of each texel of a mip level over the finer level.

use glam::{Vec3, Vec4};

use crate::texture::texels::MIN_ALPHA_WEIGHT;

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
}

/// The step from a level to the next smaller one.
pub(super) struct Downsampling {
    is_even: bool,
    /// For each texel of a row and of a column of the smaller level.
    across: Vec<Taps>,
    down: Vec<Taps>,
}

/// Texels along a side that a texel of the smaller level covers: two, or three of an odd side, the outer ones in part.
struct Taps {
    first: usize,
    /// Weights of the first texel and the next two.
    weights: [f32; 3],
}

impl Downsampling {
    /// Prepares the step from a level of size `fine`.
    pub fn new(fine: Size) -> Downsampling {
        let half = fine.half();
        Downsampling {
            is_even: fine.width == 2 * half.width && fine.height == 2 * half.height,
            across: taps(fine.width, half.width),
            down: taps(fine.height, half.height),
        }
    }

    /// Returns true if each texel of the smaller level covers 2 × 2 texels.
    pub fn is_even(&self) -> bool {
        self.is_even
    }

    /// Computes row `y` of the smaller level. `one` reads texels of the larger level singly, `four` by four.
    pub fn compute_row(
        &self,
        y: usize,
        row: &mut [Vec4],
        one: impl Fn(usize, usize) -> Vec4,
        four: impl Fn([(usize, usize); 4]) -> [Vec4; 4],
    ) {
        for (x, mean) in row.iter_mut().enumerate() {
            *mean = if self.is_even {
                let (x, y) = (2 * x, 2 * y);
                let [a, b, c, d] = four([(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)]);
                a * 0.25 + b * 0.25 + c * 0.25 + d * 0.25
            } else {
                box_mean(&self.across[x], &self.down[y], &one)
            };
        }
    }
}

/// Returns the mean over the area that a texel of the smaller level covers.
fn box_mean(across: &Taps, down: &Taps, texel: &impl Fn(usize, usize) -> Vec4) -> Vec4 {
    let mut sum = Vec4::ZERO;
    for (j, wy) in down.weights.into_iter().enumerate().filter(|w| w.1 > 0.0) {
        for (i, wx) in across.weights.into_iter().enumerate().filter(|w| w.1 > 0.0) {
            sum += texel(across.first + i, down.first + j) * (wx * wy);
        }
    }
    sum
}

/// Returns what each texel of the smaller side covers.
fn taps(size: usize, half: usize) -> Vec<Taps> {
    let of_texel = |i| {
        if size == 1 {
            return Taps { first: 0, weights: [1.0, 0.0, 0.0] };
        }
        if size == 2 * half {
            return Taps { first: 2 * i, weights: [0.5, 0.5, 0.0] };
        }
        // Texel i covers i·(2 + 1/half) to (i + 1)·(2 + 1/half).
        let n = size as f32;
        let weights = [(half - i) as f32 / n, half as f32 / n, (i + 1) as f32 / n];
        Taps { first: 2 * i, weights }
    };
    (0..half).map(of_texel).collect()
}

/// Encodes means as texels: data with `encode_data`, linear light with `encode_light`.
pub(super) fn encode_means<T>(
    means: &[Vec4],
    filter: DownsampleFilter,
    encode_data: impl Fn(f32) -> T + Copy,
    encode_light: impl Fn(f32) -> T + Copy,
    texels: &mut [T],
) {
    match texels.len() / means.len().max(1) {
        1 => encode_texels::<T, 1>(means, filter, encode_data, encode_light, texels),
        2 => encode_texels::<T, 2>(means, filter, encode_data, encode_light, texels),
        3 => encode_texels::<T, 3>(means, filter, encode_data, encode_light, texels),
        _ => encode_texels::<T, 4>(means, filter, encode_data, encode_light, texels),
    }
}

fn encode_texels<T, const CHANNELS: usize>(
    means: &[Vec4],
    filter: DownsampleFilter,
    encode_data: impl Fn(f32) -> T,
    encode_light: impl Fn(f32) -> T,
    texels: &mut [T],
) {
    let colors = if CHANNELS < 3 { 1 } else { 3 };
    for (&v, texel) in means.iter().zip(texels.as_chunks_mut::<CHANNELS>().0) {
        let (v, is_light) = match filter {
            DownsampleFilter::Data => (v, false),
            DownsampleFilter::Normals => (mean_direction(v), false),
            DownsampleFilter::Light { alpha_weighted: true }
            | DownsampleFilter::EncodedBilinear { alpha_weighted: true } => (unweight_by_alpha(v), true),
            DownsampleFilter::Light { .. } | DownsampleFilter::EncodedBilinear { .. } => (v, true),
        };
        let (color, alpha) = texel.split_at_mut(colors);
        for (c, to) in color.iter_mut().enumerate() {
            *to = if is_light { encode_light(v[c]) } else { encode_data(v[c]) };
        }
        for to in alpha {
            *to = encode_data(v.w);
        }
    }
}

/// Converts a mean of unit vectors to a texel: its direction, and √(1 − length) in alpha.
fn mean_direction(mean: Vec4) -> Vec4 {
    let n = mean.truncate();
    let length = n.length().min(1.0);
    let unit = n.try_normalize().unwrap_or(Vec3::Z);
    (unit * 0.5 + 0.5).extend((1.0 - length).sqrt())
}
