//! The first mip level: means of texels as a filter reads them.

use glam::Vec4;

use crate::texture::byte_quads::ByteQuads;
use crate::texture::downsample::{DownsampleFilter, Downsampling, Size, weight_by_alpha};
use crate::texture::interpolated_light::InterpolatedLight;
use crate::texture::normal_quads::NormalQuads;
use crate::texture::texels::TexelView;

/// Computes the first mip level of an image.
pub(super) struct FirstLevel<'a> {
    image: TexelView<'a>,
    filter: DownsampleFilter,
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
        let step = Downsampling::new(Size { width: image.width as usize, height: image.height as usize });
        let quads = match filter {
            _ if !step.is_even() => None,
            DownsampleFilter::Normals => NormalQuads::new(image).map(Quads::Normals),
            _ => ByteQuads::new(image, filter).map(Quads::Bytes),
        };
        FirstLevel { image, filter, step, quads }
    }

    /// Computes the means of row `y` of the level.
    pub fn compute_row(&self, y: usize, row: &mut [Vec4]) {
        match &self.quads {
            Some(Quads::Bytes(quads)) => quads.compute_row(y, row),
            Some(Quads::Normals(quads)) => quads.compute_row(y, row),
            None => self.filter_row(y, row),
        }
    }

    /// Computes the means of row `y` of any image.
    fn filter_row(&self, y: usize, row: &mut [Vec4]) {
        let inputs = FilterInputs::of_row(self.image, self.filter, y);
        match &inputs {
            FilterInputs::InterpolatedLight(light) if self.step.is_even() => light.compute_quads(row),
            _ => self.step.compute_row(y, row, |x, y| inputs.at([(x, y)])[0], |texels| inputs.at(texels)),
        }
    }
}

/// The values that a filter averages for a row of the first level.
enum FilterInputs<'a> {
    Data(TexelView<'a>),
    Light { image: TexelView<'a>, alpha_weighted: bool },
    InterpolatedLight(InterpolatedLight),
    Normals(TexelView<'a>),
}

impl<'a> FilterInputs<'a> {
    /// Prepares the inputs of row `y` of the level.
    fn of_row(image: TexelView<'a>, filter: DownsampleFilter, y: usize) -> FilterInputs<'a> {
        match filter {
            DownsampleFilter::Data => FilterInputs::Data(image),
            DownsampleFilter::Light { alpha_weighted } => FilterInputs::Light { image, alpha_weighted },
            DownsampleFilter::EncodedBilinear { alpha_weighted } => {
                // A row covers two, or parts of three of an odd height.
                let count = 2 + image.height as usize % 2;
                let light = InterpolatedLight::of_rows(image, 2 * y, count, alpha_weighted);
                FilterInputs::InterpolatedLight(light)
            }
            DownsampleFilter::Normals => FilterInputs::Normals(image),
        }
    }

    /// Returns the values at some texels of the image.
    #[inline]
    fn at<const N: usize>(&self, texels: [(usize, usize); N]) -> [Vec4; N] {
        let indices = |image: &TexelView| texels.map(|(x, y)| y * image.width as usize + x);
        match self {
            FilterInputs::Data(image) => image.stored_many(indices(image)),
            FilterInputs::Light { image, alpha_weighted: false } => image.decoded_many(indices(image)),
            FilterInputs::Light { image, alpha_weighted: true } => {
                image.decoded_many(indices(image)).map(weight_by_alpha)
            }
            FilterInputs::InterpolatedLight(light) => texels.map(|(x, y)| light.at(x, y)),
            FilterInputs::Normals(image) => image.stored_many(indices(image)).map(|v| {
                let v = v.truncate() * 2.0 - 1.0;
                v.normalize_or_zero().extend(0.0)
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::texels::{Channels, Texels};

    #[test]
    fn quads_are_the_means_of_single_texels() {
        let filters = [true, false].map(|alpha_weighted| {
            [DownsampleFilter::Light { alpha_weighted }, DownsampleFilter::EncodedBilinear { alpha_weighted }]
        });
        let filters = [filters.concat(), vec![DownsampleFilter::Data, DownsampleFilter::Normals]].concat();
        for (width, height) in [(2, 2), (38, 4), (7, 4), (6, 5)] {
            let size = Size { width, height };
            for channels in [Channels::L, Channels::La, Channels::Rgb, Channels::Rgba] {
                let count = width * height * channels as usize;
                let eight: Vec<u8> = (0..count).map(|i| (i * 7919 % 256) as u8).collect();
                let sixteen = eight.iter().map(|&v| u16::from(v) * 250).collect();
                for texels in [Texels::U8(eight), Texels::U16(sixteen)] {
                    let (width, height) = (width as u32, height as u32);
                    let image = TexelView { width, height, channels, texels: &texels };
                    for &filter in &filters {
                        let level = FirstLevel::new(image, filter);
                        for y in 0..size.half().height {
                            let mut means = vec![Vec4::ZERO; size.half().width];
                            let mut expected = means.clone();
                            level.compute_row(y, &mut means);
                            let inputs = FilterInputs::of_row(image, filter, y);
                            let one = |x, y| inputs.at([(x, y)])[0];
                            level.step.compute_row(y, &mut expected, one, |at| inputs.at(at));
                            assert_eq!(means, expected, "{width} x {height}, {channels:?}, {filter:?}");
                        }
                    }
                }
            }
        }
    }

    /// The mean light of an interpolated texel by its definition, from nine texels.
    fn interpolated_light(image: TexelView, x: usize, y: usize) -> Vec4 {
        let (w, h) = (image.width as usize, image.height as usize);
        let texel = |x: usize, y: usize| image.stored(y % h * w + x % w);
        let mut sum = Vec4::ZERO;
        for dx in [w - 1, 1] {
            for dy in [h - 1, 1] {
                let (near, far) = (0.788_675_1, 1.0 - 0.788_675_1);
                let sides = texel(x + dx, y) + texel(x, y + dy);
                let corner = texel(x + dx, y + dy);
                let v = texel(x, y) * (near * near) + sides * (near * far) + corner * (far * far);
                sum += crate::texture::srgb::decode_colors(v);
            }
        }
        sum * 0.25
    }

    #[test]
    fn rows_are_interpolated_as_single_texels_also_across_borders() {
        for (w, h) in [(1, 1), (1, 6), (5, 1), (2, 2), (8, 6), (7, 5), (6, 7)] {
            let texels: Vec<u8> = (0..w * h * 3).map(|i| (i * 7919 % 251) as u8).collect();
            let texels = Texels::U8(texels);
            let image = TexelView { width: w, height: h, channels: Channels::Rgb, texels: &texels };
            for y in 0..(h as usize / 2).max(1) {
                let filter = DownsampleFilter::EncodedBilinear { alpha_weighted: false };
                let inputs = FilterInputs::of_row(image, filter, y);
                let last = (2 * y + 2 + h as usize % 2).min(h as usize);
                for (x, y) in (0..w as usize).flat_map(|x| (2 * y..last).map(move |y| (x, y))) {
                    assert_eq!(inputs.at([(x, y)])[0], interpolated_light(image, x, y), "{w} x {h}");
                }
            }
        }
    }
}
