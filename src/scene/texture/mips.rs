//! Mip maps: prefiltered copies of an image, each half the size of the one before, down to 1 × 1.
//!
//! Each texel is the mean of the area that it covers, also for odd sizes. How values are averaged depends
//! on their meaning ([`DownsampleFilter`]): colours as linear light, normals as vectors. An image has
//! one pyramid for each filter, computed when it is first needed; textures that are only magnified have
//! none. Levels are stored like the image, in 8 or 16 bits with encoded colours, so that a pyramid takes a
//! third of its image.

use std::sync::OnceLock;

use crate::texture::downsample::{DownsampleFilter, Downsampling, Size};
use crate::texture::first_level::FirstLevel;
use crate::texture::level_encoding::{LevelEncoding, StoredValue};
use crate::texture::level_group::LevelGroup;
use crate::texture::max_mip::MaxMip;
use crate::texture::min_mip::MinMip;
use crate::texture::texels::{Channels, TexelView, Texels, TextureChannel};

/// The mip maps of an image, and the min-mip and max-mip pyramids of its channels. Computed on first use.
#[derive(Clone, Debug, Default)]
pub struct MipMaps {
    pyramids: [OnceLock<Vec<MipLevel>>; DownsampleFilter::COUNT],
    /// One for each [`TextureChannel`].
    min_mips: [OnceLock<MinMip>; 5],
    /// One for each [`TextureChannel`].
    max_mips: [OnceLock<MaxMip>; 5],
}

/// A mip level.
#[derive(Clone, Debug)]
pub(super) struct MipLevel {
    width: u32,
    height: u32,
    channels: Channels,
    texels: Texels,
}

impl MipLevel {
    pub fn view(&self) -> TexelView<'_> {
        TexelView { width: self.width, height: self.height, channels: self.channels, texels: &self.texels }
    }
}

impl MipMaps {
    /// Returns the levels of `image` from half its size down. The first caller computes them.
    pub(super) fn levels(&self, image: TexelView, filter: DownsampleFilter) -> &[MipLevel] {
        self.pyramids[filter.index()].get_or_init(|| pyramid(image, filter))
    }

    /// Returns the minima of a channel of `image`. The first caller computes them.
    pub(super) fn min_mip(&self, image: TexelView, channel: TextureChannel) -> &MinMip {
        self.min_mips[channel as usize].get_or_init(|| MinMip::new(image, channel))
    }

    /// Returns the maxima of a channel of `image`. The first caller computes them.
    pub(super) fn max_mip(&self, image: TexelView, channel: TextureChannel) -> &MaxMip {
        self.max_mips[channel as usize].get_or_init(|| MaxMip::new(image, channel))
    }
}

/// Computes all levels of `image`.
fn pyramid(image: TexelView, filter: DownsampleFilter) -> Vec<MipLevel> {
    match image.texels {
        Texels::U8(_) => compute_levels(image, filter, Texels::U8),
        Texels::U16(_) => compute_levels(image, filter, Texels::U16),
    }
}

fn compute_levels<T: StoredValue>(
    image: TexelView,
    filter: DownsampleFilter,
    stored: impl Fn(Vec<T>) -> Texels,
) -> Vec<MipLevel> {
    let encoding = LevelEncoding::new(image.channels, filter);
    let channels = encoding.mean_channels;
    let first = FirstLevel::new(image, filter);
    let mut size = Size { width: image.width as usize, height: image.height as usize };
    let mut levels = Vec::new();
    let mut finer: Vec<f32> = Vec::new();
    while size != (Size { width: 1, height: 1 }) {
        let group = LevelGroup::new(size, encoding);
        let (means, texels) = if levels.is_empty() {
            group.compute(&|y, rows| first.compute_rows(y, rows))
        } else {
            let step = Downsampling::new(size);
            let fine = |y: usize| &finer[y * size.width * channels..][..size.width * channels];
            group.compute(&|first, rows| {
                for (y, row) in (first..).zip(rows.chunks_mut(size.half().width * channels)) {
                    step.compute_row(y, channels, fine, row);
                }
            })
        };
        for (&half, texels) in group.sizes.iter().zip(texels) {
            let (width, height) = (half.width as u32, half.height as u32);
            levels.push(MipLevel { width, height, channels: encoding.channels, texels: stored(texels) });
            size = half;
        }
        finer = means;
    }
    levels
}
#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::mip_reference;
    use crate::{Image, TexelSemantics};

    fn image(width: u32, height: u32, channels: Channels, texels: Texels) -> Image {
        Image { name: String::new(), width, height, channels, texels, mips: MipMaps::default() }
    }

    /// A checkerboard of single black and white texels.
    fn checker(width: u32, height: u32) -> Image {
        let texels =
            (0..width * height).map(|i| if (i % width + i / width).is_multiple_of(2) { 255 } else { 0 });
        image(width, height, Channels::L, Texels::U8(texels.collect()))
    }

    fn bytes(level: &MipLevel) -> &[u8] {
        let Texels::U8(t) = &level.texels else { panic!("8 bits stay 8 bits") };
        t
    }

    const LIGHT: DownsampleFilter = DownsampleFilter::Light { alpha_weighted: false };

    /// Values that a multiplicative hash spreads, some of them in runs of equal ones.
    fn values(count: u32) -> impl Iterator<Item = u16> {
        let hash = |i: u32| i.wrapping_mul(2_654_435_761) ^ i.wrapping_mul(40_503) << 16;
        (0..count).map(move |i| match i / 64 % 4 {
            0 => {
                if hash(i / 16) & 1 << 20 == 0 {
                    0
                } else {
                    u16::MAX
                }
            }
            _ => (hash(i) >> 16) as u16,
        })
    }

    #[test]
    fn levels_are_those_of_their_definition() {
        let filters = [true, false].map(|alpha_weighted| {
            [DownsampleFilter::Light { alpha_weighted }, DownsampleFilter::EncodedBilinear { alpha_weighted }]
        });
        let filters = [filters.concat(), vec![DownsampleFilter::Data, DownsampleFilter::Normals]].concat();
        // Even and odd sides, at several levels; more than a band; rows that do not fill SIMD lanes.
        let sizes = [(1, 1), (1, 6), (5, 1), (2, 2), (38, 4), (7, 4), (6, 5), (67, 31), (64, 64), (96, 160)];
        for (width, height) in sizes {
            for channels in [Channels::L, Channels::La, Channels::Rgb, Channels::Rgba] {
                let sixteen: Vec<u16> = values(width * height * channels as u32).collect();
                let eight = sixteen.iter().map(|v| (v >> 8) as u8).collect();
                for texels in [Texels::U8(eight), Texels::U16(sixteen)] {
                    let image = image(width, height, channels, texels);
                    for &filter in &filters {
                        let levels = image.mips.levels(image.view(), filter);
                        let expected = mip_reference::levels(image.view(), filter);
                        assert_eq!(levels.len(), expected.len());
                        for (i, (level, expected)) in levels.iter().zip(&expected).enumerate() {
                            let is_equal = match (&level.texels, expected) {
                                (Texels::U8(level), Texels::U8(expected)) => level == expected,
                                (Texels::U16(level), Texels::U16(expected)) => level == expected,
                                _ => false,
                            };
                            assert!(is_equal, "level {i} of {width} x {height}, {channels:?}, {filter:?}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn colours_are_averaged_as_linear_light_and_data_as_stored() {
        let image = checker(8, 4);
        let light = image.mips.levels(image.view(), LIGHT);
        let data = image.mips.levels(image.view(), DownsampleFilter::Data);
        assert_eq!(light.len(), 3);
        for (light, data) in light.iter().zip(data) {
            assert!(bytes(light).iter().all(|&v| v == 188) && bytes(data).iter().all(|&v| v == 128));
        }
        assert_eq!((light[2].width, light[2].height), (1, 1));
    }

    #[test]
    fn odd_sizes_keep_the_mean() {
        // Each level rounds once, from unrounded means.
        for (w, h) in [(1, 1), (1, 7), (2, 2), (3, 5), (7, 1), (37, 11), (64, 3), (101, 255)] {
            let texels: Vec<u8> = (0..w * h).map(|i| (i * 7919 % 251) as u8).collect();
            let mean = texels.iter().map(|&v| f64::from(v)).sum::<f64>() / f64::from(w * h);
            let image = image(w, h, Channels::L, Texels::U8(texels));
            let levels = image.mips.levels(image.view(), DownsampleFilter::Data);
            assert_eq!(levels.len(), w.max(h).ilog2() as usize);
            if let Some(last) = levels.last() {
                assert!((f64::from(bytes(last)[0]) - mean).abs() < 0.51, "{w} x {h}");
            }
        }
    }

    #[test]
    fn sixteen_bit_images_have_sixteen_bit_levels() {
        let image = image(2, 1, Channels::La, Texels::U16(vec![0, 0, 65535, 4]));
        let Texels::U16(t) = &image.mips.levels(image.view(), LIGHT)[0].texels else { panic!("16 bits") };
        assert_eq!(t, &[48192, 2]);
    }

    #[test]
    fn transparent_texels_do_not_contribute_to_alpha_weighted_colours() {
        let texels = vec![255, 0, 0, 255, 0, 255, 0, 0];
        let image = image(2, 1, Channels::Rgba, Texels::U8(texels));
        assert_eq!(
            bytes(&image.mips.levels(image.view(), DownsampleFilter::Light { alpha_weighted: true })[0]),
            [255, 0, 0, 128]
        );
        assert_eq!(bytes(&image.mips.levels(image.view(), LIGHT)[0]), [188, 188, 0, 128]);
    }

    #[test]
    fn normals_are_averaged_as_vectors_and_their_shortening_is_stored() {
        // Two normals tilted by ±45°: their mean is upright and cos 45° long.
        let tilted = |x: f32| [(x * 0.5 + 0.5) * 255.0, 127.5, 255.0 * (0.5 + 0.5 * 0.5f32.sqrt())];
        let s = 0.5f32.sqrt();
        let texels = [tilted(s), tilted(-s)].concat().iter().map(|&v| v.round() as u8).collect();
        let image = image(2, 1, Channels::Rgb, Texels::U8(texels));
        let level = &image.mips.levels(image.view(), DownsampleFilter::Normals)[0];
        let expected = (1.0 - s).sqrt() * 255.0;
        let [x, y, z, shortening] = bytes(level) else { panic!("one texel of four channels") };
        assert!(x.abs_diff(128) <= 1 && y.abs_diff(128) <= 1 && *z == 255);
        assert!((f32::from(*shortening) - expected).abs() < 2.0, "{shortening}");
    }

    #[test]
    fn levels_of_encoded_interpolation_are_as_bright_as_the_interpolated_image() {
        // Integrates the interpolated checkerboard by brute force.
        let image = checker(8, 8);
        let texture = crate::Texture { decode_last: true, ..Default::default() };
        let n = 256;
        let at = |i: u32| (f64::from(i) + 0.5) as f32 / n as f32 / 4.0;
        let uvs = (0..n * n).map(|i| glam::Vec2::new(at(i % n), at(i / n)));
        let images = [image];
        let sum: f64 = uvs.map(|uv| f64::from(texture.sample(&images, uv, TexelSemantics::Color).x)).sum();
        let mean = sum / f64::from(n * n);
        let level = &images[0]
            .mips
            .levels(images[0].view(), DownsampleFilter::EncodedBilinear { alpha_weighted: false })[0];
        let level_light = f64::from(level.view().decoded(0).x);
        assert!((level_light / mean - 1.0).abs() < 0.01, "{level_light}, not {mean}");
        assert!(mean < 0.26, "less than half of the light, as in Blender");
    }

    #[test]
    fn levels_do_not_depend_on_the_number_of_threads() {
        let texels: Vec<u8> =
            (0..1021u32 * 517).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let levels = |threads: usize| {
            let image = image(1021, 517, Channels::L, Texels::U8(texels.clone()));
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                image.mips.levels(image.view(), LIGHT).iter().map(|l| bytes(l).to_vec()).collect::<Vec<_>>()
            })
        };
        let one = levels(1);
        assert!(one.len() == 9 && one == levels(3) && one == levels(7));
    }
}
