//! The first mip level: means of texels as a filter reads them.

use crate::texture::byte_quads::ByteQuads;
use crate::texture::downsample::{DownsampleFilter, Downsampling, Size};
use crate::texture::interpolated_light::InterpolatedLight;
use crate::texture::normal_quads::{NormalQuads, unit_vectors_of_row};
use crate::texture::srgb::{decode_table_8, decode_table_16};
use crate::texture::texels::{Channels, MIN_ALPHA_WEIGHT, TexelView, Texels};

/// Rows of the level that are computed together from interpolated texels, which need those above and below.
const INTERPOLATED_ROWS: usize = 4;

/// Computes the first mip level of an image.
pub(super) struct FirstLevel<'a> {
    image: TexelView<'a>,
    filter: DownsampleFilter,
    channels: usize,
    size: Size,
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
        let quads = match filter {
            _ if !size.is_even() => None,
            DownsampleFilter::Normals => NormalQuads::new(image).map(Quads::Normals),
            _ => ByteQuads::new(image, filter).map(Quads::Bytes),
        };
        let channels = filter.mean_channels(image.channels);
        FirstLevel { image, filter, channels, size, step: Downsampling::new(size), quads }
    }

    /// Computes the means of rows of the level from `first` on.
    pub fn compute_rows(&self, first: usize, rows: &mut [f32]) {
        let row = self.size.half().width * self.channels;
        if let DownsampleFilter::EncodedBilinear { alpha_weighted } = self.filter {
            for (i, rows) in rows.chunks_mut(INTERPOLATED_ROWS * row).enumerate() {
                self.interpolate_rows(first + i * INTERPOLATED_ROWS, alpha_weighted, rows);
            }
            return;
        }
        for (y, means) in (first..).zip(rows.chunks_mut(row)) {
            match &self.quads {
                Some(Quads::Bytes(quads)) => quads.compute_row(y, means),
                Some(Quads::Normals(quads)) => quads.compute_row(y, means),
                None => {
                    let covered = self.step.covered_rows(y);
                    let inputs: Vec<Vec<f32>> = covered.clone().map(|y| self.filter_inputs(y)).collect();
                    self.step.compute_row(y, self.channels, |y| &inputs[y - covered.start], means);
                }
            }
        }
    }

    /// Computes rows of the mean light of interpolated texels.
    fn interpolate_rows(&self, first: usize, alpha_weighted: bool, rows: &mut [f32]) {
        let row = self.size.half().width * self.channels;
        let last = first + rows.len() / row - 1;
        let covered = self.step.covered_rows(first).start..self.step.covered_rows(last).end;
        let light = InterpolatedLight::of_rows(self.image, covered.start, covered.len(), alpha_weighted);
        if self.size.is_even() {
            for (y, means) in rows.chunks_mut(row).enumerate() {
                light.compute_quads(y, means);
            }
            return;
        }
        let inputs: Vec<Vec<f32>> = (0..covered.len()).map(|y| light.row(y, self.size.width)).collect();
        for (y, means) in (first..).zip(rows.chunks_mut(row)) {
            self.step.compute_row(y, self.channels, |y| &inputs[y - covered.start], means);
        }
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
