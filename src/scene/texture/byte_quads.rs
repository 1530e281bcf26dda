//! Means of 2 × 2 texels of an 8-bit image, channel by channel from tables: the first mip level of most textures.

use std::sync::OnceLock;

use crate::texture::downsample::DownsampleFilter;
use crate::texture::srgb::decode_table_8;
use crate::texture::texels::{Channels, TexelView, Texels};

/// A quarter of the value of each byte.
type Quarters = [f32; 256];

/// An 8-bit image of even size, whose texels are averaged as they are: data, or light without weights.
pub(super) struct ByteQuads<'a> {
    bytes: &'a [u8],
    width: usize,
    channels: Channels,
    color: &'static Quarters,
}

impl<'a> ByteQuads<'a> {
    /// Takes an image of even width and height. Returns `None` for other texels and filters.
    pub fn new(image: TexelView<'a>, filter: DownsampleFilter) -> Option<ByteQuads<'a>> {
        let Texels::U8(bytes) = image.texels else { return None };
        let color = match filter {
            DownsampleFilter::Data => data_quarters(),
            DownsampleFilter::Light { alpha_weighted: false } => light_quarters(),
            _ => return None,
        };
        Some(ByteQuads { bytes, width: image.width as usize, channels: image.channels, color })
    }

    /// Computes the means of row `y` of the level.
    pub fn compute_row(&self, y: usize, row: &mut [f32]) {
        match self.channels {
            Channels::L => self.means::<1>(y, row),
            Channels::La => self.means::<2>(y, row),
            Channels::Rgb => self.means::<3>(y, row),
            Channels::Rgba => self.means::<4>(y, row),
        }
    }

    fn means<const CHANNELS: usize>(&self, y: usize, row: &mut [f32]) {
        let (texels, _) = self.bytes.as_chunks::<CHANNELS>();
        let fine = |y: usize| texels[y * self.width..][..self.width].as_chunks::<2>().0;
        let alpha = data_quarters();
        let (row, _) = row.as_chunks_mut::<CHANNELS>();
        for ((mean, above), below) in row.iter_mut().zip(fine(2 * y)).zip(fine(2 * y + 1)) {
            for (channel, mean) in mean.iter_mut().enumerate() {
                let is_alpha = CHANNELS.is_multiple_of(2) && channel + 1 == CHANNELS;
                let table = if is_alpha { alpha } else { self.color };
                let quarter = |texel: &[u8; CHANNELS]| table[usize::from(texel[channel])];
                // Quarters of floats are exact, so their order alone rounds.
                *mean = quarter(&above[0]) + quarter(&above[1]) + quarter(&below[0]) + quarter(&below[1]);
            }
        }
    }
}

fn data_quarters() -> &'static Quarters {
    static TABLE: OnceLock<Quarters> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|i| i as f32 / 255.0 * 0.25))
}

fn light_quarters() -> &'static Quarters {
    static TABLE: OnceLock<Quarters> = OnceLock::new();
    TABLE.get_or_init(|| decode_table_8().map(|light| light * 0.25))
}
