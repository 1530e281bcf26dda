//! Encoding of the means of a mip level as texels, in SIMD lanes.

use crate::texture::downsample::DownsampleFilter;
use crate::texture::srgb::{EncodeTable, linear_to_srgb16};
use crate::texture::texels::{Channels, MIN_ALPHA_WEIGHT};
use blinn_core::simd::{AutovecKernel, SimdLevel};

/// Values that are encoded side by side: whole texels of one, two or four channels.
const LANES: usize = 16;

/// A stored value of a texel.
pub(super) trait StoredValue: Copy + Default + Send {
    /// Encodes data in 0…1.
    fn encode_data<const N: usize>(values: &[f32; N]) -> [Self; N];

    /// Encodes linear light.
    fn encode_light<const N: usize>(values: &[f32; N], table: &EncodeTable) -> [Self; N];
}

impl StoredValue for u8 {
    #[inline(always)]
    fn encode_data<const N: usize>(values: &[f32; N]) -> [u8; N] {
        let integers = to_integers(values, 255.0);
        let mut texels = [0; N];
        for (to, v) in texels.iter_mut().zip(integers) {
            *to = (v & 0xff) as u8;
        }
        texels
    }

    #[inline(always)]
    fn encode_light<const N: usize>(values: &[f32; N], table: &EncodeTable) -> [u8; N] {
        table.encode_lanes(values)
    }
}

impl StoredValue for u16 {
    #[inline(always)]
    fn encode_data<const N: usize>(values: &[f32; N]) -> [u16; N] {
        let integers = to_integers(values, 65535.0);
        let mut texels = [0; N];
        for (to, v) in texels.iter_mut().zip(integers) {
            *to = (v & 0xffff) as u16;
        }
        texels
    }

    #[inline(always)]
    fn encode_light<const N: usize>(values: &[f32; N], _: &EncodeTable) -> [u16; N] {
        let mut texels = [0; N];
        for (to, v) in texels.iter_mut().zip(values) {
            *to = linear_to_srgb16(*v);
        }
        texels
    }
}

/// Rounds values times `max` to integers in 0…`max`, without conversions, which vectorise worse.
#[inline(always)]
fn to_integers<const N: usize>(values: &[f32; N], max: f32) -> [u32; N] {
    // Numbers from here to its double are integers, which the lowest bits hold.
    const INTEGERS: f32 = 8_388_608.0;
    let mut integers = [0; N];
    for (to, v) in integers.iter_mut().zip(values) {
        let v = v * max + 0.5;
        // NaN compares false and becomes 0.
        let v = if v > 0.0 { v } else { 0.0 };
        let v = if v < max { v } else { max };
        let rounded = (v + INTEGERS) - INTEGERS;
        let floor = if rounded > v { rounded - 1.0 } else { rounded };
        *to = (floor + INTEGERS).to_bits() & 0x7f_ffff;
    }
    integers
}

/// How the means of an image's levels are encoded.
#[derive(Clone, Copy)]
pub(super) struct LevelEncoding {
    filter: DownsampleFilter,
    /// Channels of a mean.
    pub mean_channels: usize,
    /// Channels of a texel.
    pub channels: Channels,
    /// The SIMD level of all loops over means.
    pub simd: SimdLevel,
}

impl LevelEncoding {
    pub fn new(image: Channels, filter: DownsampleFilter) -> LevelEncoding {
        let channels = if filter == DownsampleFilter::Normals { Channels::Rgba } else { image };
        LevelEncoding {
            filter,
            mean_channels: filter.mean_channels(image),
            channels,
            simd: SimdLevel::detect(),
        }
    }

    /// Encodes means as texels.
    pub fn encode<T: StoredValue>(&self, means: &[f32], texels: &mut [T]) {
        match self.filter {
            DownsampleFilter::Normals => self.simd.run(EncodeNormals { means, texels }),
            DownsampleFilter::Data => self.simd.run(EncodeData { means, texels }),
            DownsampleFilter::Light { alpha_weighted }
            | DownsampleFilter::EncodedBilinear { alpha_weighted } => {
                let LevelEncoding { mean_channels, channels, .. } = *self;
                let table = EncodeTable::get();
                self.simd.run(EncodeLight { means, mean_channels, channels, alpha_weighted, table, texels });
            }
        }
    }
}

/// Encodes data value by value.
struct EncodeData<'a, T> {
    means: &'a [f32],
    texels: &'a mut [T],
}

impl<T: StoredValue> AutovecKernel for EncodeData<'_, T> {
    #[inline(always)]
    fn run(self) {
        let (means, rest) = self.means.as_chunks::<LANES>();
        let (texels, last) = self.texels.as_chunks_mut::<LANES>();
        for (to, values) in texels.iter_mut().zip(means) {
            *to = T::encode_data(values);
        }
        for (to, v) in last.iter_mut().zip(rest) {
            [*to] = T::encode_data(&[*v]);
        }
    }
}

/// Encodes light, and alpha as data.
struct EncodeLight<'a, T> {
    means: &'a [f32],
    mean_channels: usize,
    channels: Channels,
    alpha_weighted: bool,
    table: &'a EncodeTable,
    texels: &'a mut [T],
}

impl<T: StoredValue> AutovecKernel for EncodeLight<'_, T> {
    #[inline(always)]
    fn run(mut self) {
        match (self.mean_channels, self.alpha_weighted) {
            (_, false) => self.encode_flat(),
            (2, true) => self.encode_weighted::<2>(),
            (_, true) => self.encode_weighted::<4>(),
        }
        match self.channels {
            Channels::L | Channels::Rgb => {}
            Channels::La => self.encode_alpha::<2>(),
            Channels::Rgba => self.encode_alpha::<4>(),
        }
    }
}

impl<T: StoredValue> EncodeLight<'_, T> {
    /// Encodes all values as light, also alpha: lanes that are left out make lookups slower.
    #[inline(always)]
    fn encode_flat(&mut self) {
        let (means, rest) = self.means.as_chunks::<LANES>();
        let (texels, last) = self.texels.as_chunks_mut::<LANES>();
        for (to, values) in texels.iter_mut().zip(means) {
            *to = T::encode_light(values, self.table);
        }
        for (to, v) in last.iter_mut().zip(rest) {
            [*to] = T::encode_light(&[*v], self.table);
        }
    }

    /// Encodes means whose last channel is the weight of the others.
    #[inline(always)]
    fn encode_weighted<const CHANNELS: usize>(&mut self) {
        let (chunks, rest) = self.means.as_chunks::<LANES>();
        let mut last = [0.0; LANES];
        last[..rest.len()].copy_from_slice(rest);
        // Texels of images without alpha leave out the weight.
        let channels = self.channels as usize;
        let texels = self.texels.chunks_mut(LANES / CHANNELS * channels);
        for (values, to) in chunks.iter().chain([&last]).zip(texels) {
            let mut light = [0.0; LANES];
            for (i, light) in light.iter_mut().enumerate() {
                *light = values[i] / (values[i / CHANNELS * CHANNELS + CHANNELS - 1] + MIN_ALPHA_WEIGHT);
            }
            let encoded = T::encode_light(&light, self.table);
            if to.len() == LANES {
                to.copy_from_slice(&encoded);
                continue;
            }
            for (to, texel) in to.chunks_mut(channels).zip(encoded.as_chunks::<CHANNELS>().0) {
                to.copy_from_slice(&texel[..channels]);
            }
        }
    }

    /// Encodes the last channel of each texel as data.
    #[inline(always)]
    fn encode_alpha<const CHANNELS: usize>(&mut self) {
        let means = self.means.as_chunks::<CHANNELS>().0.chunks(LANES);
        let texels = self.texels.as_chunks_mut::<CHANNELS>().0.chunks_mut(LANES);
        for (means, texels) in means.zip(texels) {
            let mut alpha = [0.0; LANES];
            for (alpha, mean) in alpha.iter_mut().zip(means) {
                *alpha = mean[CHANNELS - 1];
            }
            for (to, alpha) in texels.iter_mut().zip(T::encode_data(&alpha)) {
                to[CHANNELS - 1] = alpha;
            }
        }
    }
}

/// Encodes means of unit vectors: their direction, and √(1 − length) in alpha.
struct EncodeNormals<'a, T> {
    means: &'a [f32],
    texels: &'a mut [T],
}

impl<T: StoredValue> AutovecKernel for EncodeNormals<'_, T> {
    #[inline(always)]
    fn run(self) {
        let means = self.means.as_chunks::<3>().0.chunks(LANES);
        let texels = self.texels.as_chunks_mut::<4>().0.chunks_mut(LANES);
        for (means, texels) in means.zip(texels) {
            let mut axes = [[0.0f32; LANES]; 3];
            for (i, mean) in means.iter().enumerate().take(LANES) {
                for (axis, v) in axes.iter_mut().zip(mean) {
                    axis[i] = *v;
                }
            }
            let [x, y, z] = axes;
            let (mut unit, mut shortening) = ([[0.0; LANES]; 3], [0.0; LANES]);
            for i in 0..LANES {
                let length = (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).sqrt();
                let scale = 1.0 / length;
                // The mean of opposite vectors has no direction, and becomes z.
                let has_direction = scale < f32::INFINITY;
                let scale = if has_direction { scale } else { 0.0 };
                unit[0][i] = x[i] * scale * 0.5 + 0.5;
                unit[1][i] = y[i] * scale * 0.5 + 0.5;
                unit[2][i] = if has_direction { z[i] * scale } else { 1.0 } * 0.5 + 0.5;
                let length = if length < 1.0 { length } else { 1.0 };
                shortening[i] = (1.0 - length).sqrt();
            }
            let [x, y, z] = unit;
            let (x, y) = (T::encode_data(&x), T::encode_data(&y));
            let (z, w) = (T::encode_data(&z), T::encode_data(&shortening));
            for (i, texel) in texels.iter_mut().enumerate().take(LANES) {
                *texel = [x[i], y[i], z[i], w[i]];
            }
        }
    }
}
