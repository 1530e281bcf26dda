//! Max-mip pyramids: maxima of image regions, which bound texture lookups from above.

use std::ops::Range;

use crate::texture::min_mip::MinMip;
use crate::texture::texels::{TexelView, TextureChannel};

/// The maxima of a channel in square cells: a min-mip pyramid of one minus the channel.
#[derive(Clone, Debug)]
pub(crate) struct MaxMip(MinMip);

impl MaxMip {
    /// Computes the maxima of a channel.
    pub fn new(image: TexelView, channel: TextureChannel) -> MaxMip {
        MaxMip(MinMip::of_complement(image, channel))
    }

    /// Returns the maximum of the whole image.
    pub fn max(&self) -> f32 {
        1.0 - self.0.min()
    }

    /// Returns an upper bound of the texels in `x` by `y`; −infinity for an empty range.
    pub fn max_over(&self, x: &Range<usize>, y: &Range<usize>) -> f32 {
        1.0 - self.0.min_over(x, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channels, Texels};

    #[test]
    fn ranges_are_bounded_from_above() {
        let (width, height) = (37u32, 90u32);
        let values: Vec<u8> =
            (0..width * height).map(|i| if i % 61 == 60 { 249 + (i % 7) as u8 } else { 0 }).collect();
        let texels = Texels::U8(values.clone());
        let view = TexelView { width, height, channels: Channels::L, texels: &texels };
        let max_mip = MaxMip::new(view, TextureChannel::R);
        assert_eq!(max_mip.max(), 1.0);
        assert_eq!(MaxMip::new(view, TextureChannel::A).max(), 1.0, "a missing alpha is 1");
        for i in 0..400usize {
            let (x, y) = (i * 7 % 37, i * 11 % 90);
            let (x, y) = (x..(x + 1 + i % 9).min(37), y..(y + 1 + i % 5).min(90));
            let row_max = |row: usize| values[row * 37..][x.clone()].iter().max().copied();
            let exact = f32::from(y.clone().filter_map(row_max).max().unwrap_or(0)) / 255.0;
            assert!(max_mip.max_over(&x, &y) >= exact - 1e-6, "{x:?} {y:?}");
        }
        let clear = Texels::U8(vec![9, 0, 9, 0]);
        let clear = TexelView { width: 2, height: 1, channels: Channels::La, texels: &clear };
        assert_eq!(MaxMip::new(clear, TextureChannel::A).max(), 0.0);
    }
}
