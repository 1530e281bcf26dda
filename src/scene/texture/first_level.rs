//! The first mip level: means of texels as a filter reads them.

use crate::texture::byte_quads::ByteQuads;
use crate::texture::downsample::{DownsampleFilter, Downsampling, Size};
use crate::texture::interpolated_light::InterpolatedLight;
use crate::texture::normal_quads::{NormalQuads, unit_vectors_of_row};
use crate::texture::srgb::{decode_table_8, decode_table_16};
use crate::texture::texels::{Channels, MIN_ALPHA_WEIGHT, TexelView, Texels};

/// Computes the first mip level of an image.
pub(super) struct FirstLevel<'a> {
    image: TexelView<'a>,
    filter: DownsampleFilter,
    channels: usize,
    is_even: bool,
    step: Downsampling,
    /// The fast way, for most images.
    quads: Option<Quads<'a>>,
}

/// Means of 2 × 2 bytes.
enum Quads<'a> {
    Bytes(ByteQuads<'a>),
    Normals(NormalQuads<'a>),
}

impl<'a> FirstLevel<'a> {
    pub fn new(image: TexelView<'a>, filter: DownsampleFilter) -> FirstLevel<'a> {
        let size = Size { width: image.width as usize, height: image.height as usize };
        let is_even = size.is_even();
        let quads = match filter {
            _ if !is_even => None,
            DownsampleFilter::Normals => NormalQuads::new(image).map(Quads::Normals),
            _ => ByteQuads::new(image, filter).map(Quads::Bytes),
        };
        let channels = filter.mean_channels(image.channels);
        FirstLevel { image, filter, channels, is_even, step: Downsampling::new(size), quads }
    }

    /// Computes the means of row `y` of the level.
    pub fn compute_row(&self, y: usize, row: &mut [f32]) {
        match &self.quads {
            Some(Quads::Bytes(quads)) => quads.compute_row(y, row),
            Some(Quads::Normals(quads)) => quads.compute_row(y, row),
            None => self.filter_row(y, row),
        }
    }

    /// Computes the means of row `y` of any image.
    fn filter_row(&self, y: usize, row: &mut [f32]) {
        let covered = self.step.covered_rows(y);
        let rows: Vec<Vec<f32>> = match self.filter {
            DownsampleFilter::EncodedBilinear { alpha_weighted } => {
                let light =
                    InterpolatedLight::of_rows(self.image, covered.start, covered.len(), alpha_weighted);
                if self.is_even {
                    return light.compute_quads(row);
                }
                covered.clone().map(|y| light.row(y, self.image.width as usize)).collect()
            }
            _ => covered.clone().map(|y| self.filter_inputs(y)).collect(),
        };
        self.step.compute_row(y, self.channels, |y| &rows[y - covered.start], row);
    }

    /// Returns the values of row `y` of the image that the filter averages.
    fn filter_inputs(&self, y: usize) -> Vec<f32> {
        let row = self.image.width as usize * self.image.channels as usize;
        let values = y * row..(y + 1) * row;
        match (self.filter, self.image.texels) {
            (DownsampleFilter::Normals, _) => unit_vectors_of_row(self.image, y),
            (DownsampleFilter::Data, Texels::U8(texels)) => {
                texels[values].iter().map(|v| f32::from(*v) / 255.0).collect()
            }
            (DownsampleFilter::Data, Texels::U16(texels)) => {
                texels[values].iter().map(|v| f32::from(*v) / 65535.0).collect()
            }
            (_, Texels::U8(texels)) => {
                let table = decode_table_8();
                self.decode(&texels[values], |v| table[usize::from(v)], |v| f32::from(v) / 255.0)
            }
            (_, Texels::U16(texels)) => {
                let table = decode_table_16();
                self.decode(&texels[values], |v| table[usize::from(v)], |v| f32::from(v) / 65535.0)
            }
        }
    }

    /// Decodes a row of colours and their alpha. Weights colours by alpha if the filter does.
    fn decode<T: Copy>(&self, texels: &[T], light: impl Fn(T) -> f32, alpha: impl Fn(T) -> f32) -> Vec<f32> {
        match (self.image.channels, self.filter.is_alpha_weighted()) {
            (Channels::L | Channels::Rgb, false) => texels.iter().map(|v| light(*v)).collect(),
            (Channels::La, weighted) => decode_texels::<T, 2, 2>(texels, light, alpha, weighted),
            (Channels::Rgba, weighted) => decode_texels::<T, 4, 4>(texels, light, alpha, weighted),
            (Channels::L, true) => decode_texels::<T, 1, 2>(texels, light, alpha, true),
            (Channels::Rgb, true) => decode_texels::<T, 3, 4>(texels, light, alpha, true),
        }
    }
}

/// Decodes texels to light and alpha, which is 1 where they have none.
fn decode_texels<T: Copy, const CHANNELS: usize, const WITH_ALPHA: usize>(
    texels: &[T],
    light: impl Fn(T) -> f32,
    alpha: impl Fn(T) -> f32,
    is_weighted: bool,
) -> Vec<f32> {
    let decode = |texel: &[T; CHANNELS]| {
        let alpha = if CHANNELS == WITH_ALPHA { alpha(texel[CHANNELS - 1]) } else { 1.0 };
        let weight = if is_weighted { alpha + MIN_ALPHA_WEIGHT } else { 1.0 };
        let mut decoded = [alpha; WITH_ALPHA];
        for (to, v) in decoded.iter_mut().zip(&texel[..WITH_ALPHA - 1]) {
            *to = light(*v) * weight;
        }
        decoded
    };
    texels.as_chunks().0.iter().map(decode).collect::<Vec<_>>().into_flattened()
}
