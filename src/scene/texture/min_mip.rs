//! Min-mip pyramids: minima of image regions, which bound texture lookups from below.

use std::ops::Range;

use crate::texture::texels::{TexelView, Texels, TextureChannel};

/// log2 of the side of the smallest cells, in texels.
const FINEST_SHIFT: u32 = 2;
/// Most cells along a side that a query reads.
const MAX_CELLS: usize = 4;

/// The minima of a channel in square cells. Each level halves the resolution of the one before.
#[derive(Clone, Debug)]
pub(crate) struct MinMip {
    levels: Vec<MinLevel>,
    /// The stored value of 1.
    one: f32,
}

/// The minima of one level.
#[derive(Clone, Debug)]
struct MinLevel {
    width: usize,
    /// As the image stores its values.
    minima: Vec<u16>,
}

/// The layout of values from which a level is built.
#[derive(Clone, Copy)]
struct Layout {
    /// Texels in a row.
    width: usize,
    /// Values of a texel.
    channels: usize,
}

impl MinLevel {
    /// Computes the minima of cells of `2^shift` by `2^shift` texels. `value` selects the value of a texel.
    fn new<T: Copy>(texels: &[T], layout: Layout, shift: u32, value: impl Fn(&[T]) -> u16) -> MinLevel {
        let Layout { width, channels } = layout;
        let rows = texels.chunks_exact((width * channels).max(1));
        let across = width.div_ceil(1 << shift);
        let mut minima = vec![u16::MAX; across * rows.len().div_ceil(1 << shift)];
        for (y, row) in rows.enumerate() {
            let cells = &mut minima[(y >> shift) * across..][..across];
            for (min, texels) in cells.iter_mut().zip(row.chunks(channels << shift)) {
                *min = texels.chunks_exact(channels).map(&value).fold(*min, u16::min);
            }
        }
        MinLevel { width: across, minima }
    }
}

impl MinMip {
    /// Computes the minima of a channel.
    pub fn new(image: TexelView, channel: TextureChannel) -> MinMip {
        MinMip::of_mapped(image, channel, |value, _one| value)
    }

    /// Computes the minima of one minus a channel.
    pub fn of_complement(image: TexelView, channel: TextureChannel) -> MinMip {
        MinMip::of_mapped(image, channel, |value, one| one - value)
    }

    /// Computes the minima of `map(value, one)` of a channel, as the image stores its values.
    fn of_mapped(image: TexelView, channel: TextureChannel, map: impl Fn(u16, u16) -> u16) -> MinMip {
        let layout = Layout { width: image.width as usize, channels: image.channels as usize };
        let one = match image.texels {
            Texels::U8(_) => u16::from(u8::MAX),
            Texels::U16(_) => u16::MAX,
        };
        let map = |value: u16| map(value, one);
        let finest = match image.texels {
            Texels::U8(texels) => finest(texels, layout, channel, one, map),
            Texels::U16(texels) => finest(texels, layout, channel, one, map),
        };
        let mut levels = vec![finest];
        while let Some(finer) = levels.last().filter(|finer| finer.minima.len() > 1) {
            let layout = Layout { width: finer.width, channels: 1 };
            levels.push(MinLevel::new(&finer.minima, layout, 1, |min| min[0]));
        }
        MinMip { levels, one: f32::from(one) }
    }

    /// Returns the minimum of the whole image.
    pub fn min(&self) -> f32 {
        self.levels.last().and_then(|top| top.minima.first()).map_or(f32::INFINITY, |&top| self.value(top))
    }

    /// Returns a lower bound of the texels in `x` by `y`; infinity for an empty range.
    pub fn min_over(&self, x: &Range<usize>, y: &Range<usize>) -> f32 {
        if x.is_empty() || y.is_empty() {
            return f32::INFINITY;
        }
        let cells = |range: &Range<usize>, level: usize| {
            let shift = FINEST_SHIFT as usize + level;
            range.start >> shift..((range.end - 1) >> shift) + 1
        };
        let has_few_cells = |level: &usize| cells(x, *level).len().max(cells(y, *level).len()) <= MAX_CELLS;
        let level = (0..self.levels.len()).find(has_few_cells).unwrap_or(self.levels.len() - 1);
        let MinLevel { width, minima } = &self.levels[level];
        let rows = cells(y, level).flat_map(|row| &minima[row * width..][cells(x, level)]);
        rows.min().map_or(f32::INFINITY, |&min| self.value(min))
    }

    fn value(&self, stored: u16) -> f32 {
        f32::from(stored) / self.one
    }
}

/// Computes the finest level of mapped values. `one` is the greatest value of a channel.
fn finest<T: Copy + Into<u16>>(
    texels: &[T],
    layout: Layout,
    channel: TextureChannel,
    one: u16,
    map: impl Fn(u16) -> u16,
) -> MinLevel {
    let channels = layout.channels;
    let colors = if channels < 3 { 1 } else { 3 };
    let nth = match channel {
        TextureChannel::R => 0,
        TextureChannel::G => 1.min(colors - 1),
        TextureChannel::B => colors - 1,
        TextureChannel::A if channels == colors => {
            return MinLevel::new(texels, layout, FINEST_SHIFT, |_| map(one));
        }
        TextureChannel::A => channels - 1,
        // The minimum of the colours bounds their mean.
        TextureChannel::Mean => {
            let min = |texel: &[T]| texel[..colors].iter().map(|&c| map(c.into())).min().unwrap_or(0);
            return MinLevel::new(texels, layout, FINEST_SHIFT, min);
        }
    };
    MinLevel::new(texels, layout, FINEST_SHIFT, |texel| map(texel[nth].into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channels, Texels};

    /// Bounds never exceed the minimum, mostly equal it, and are exact for the whole image.
    #[test]
    fn ranges_are_bounded_from_below() {
        for (width, height) in [(1u32, 1u32), (4, 4), (5, 3), (64, 64), (37, 90), (1, 300)] {
            let values: Vec<u8> =
                (0..width * height).map(|i| if i % 61 == 60 { (i % 7) as u8 } else { 255 }).collect();
            let texels = Texels::U8(values.clone());
            let view = TexelView { width, height, channels: Channels::L, texels: &texels };
            let min_mip = MinMip::new(view, TextureChannel::R);
            let (w, h) = (width as usize, height as usize);
            let min = |x: Range<usize>, y: Range<usize>| {
                let at = |y: usize| values[y * w..][x.clone()].iter().min().copied();
                f32::from(y.filter_map(at).min().unwrap_or(255)) / 255.0
            };
            assert_eq!(min_mip.min(), min(0..w, 0..h));
            let mut close = 0;
            let all: Vec<_> = (0..400).map(|i| (i * 7 % w, i * 11 % h, 1 + i % 9, 1 + i % 5)).collect();
            for &(x, y, across, down) in &all {
                let (x, y) = (x..(x + across).min(w), y..(y + down).min(h));
                let (bound, exact) = (min_mip.min_over(&x, &y), min(x.clone(), y.clone()));
                assert!(bound <= exact, "{x:?} {y:?} of {width} x {height}");
                close += usize::from(bound == exact);
            }
            assert!(close > all.len() / 2, "{close} of {} in {width} x {height}", all.len());
            assert_eq!(min_mip.min_over(&(0..0), &(0..1)), f32::INFINITY);
        }
    }

    #[test]
    fn every_layout_has_all_channels() {
        use TextureChannel::{A, B, G, Mean, R};
        let min = |channels, texels, channel| {
            let view = TexelView { width: 2, height: 1, channels, texels: &texels };
            MinMip::new(view, channel).min()
        };
        let eight = |texels: &[u8]| Texels::U8(texels.to_vec());
        for (channels, texels, expected) in [
            (Channels::L, eight(&[51, 102]), [0.2, 0.2, 0.2, 1.0]),
            (Channels::La, eight(&[51, 204, 102, 153]), [0.2, 0.2, 0.2, 0.6]),
            (Channels::Rgb, eight(&[51, 255, 204, 102, 153, 255]), [0.2, 0.6, 0.8, 1.0]),
            (Channels::Rgba, eight(&[51, 255, 204, 102, 153, 153, 255, 51]), [0.2, 0.6, 0.8, 0.2]),
            (Channels::La, Texels::U16(vec![13107, 52428, 26214, 39321]), [0.2, 0.2, 0.2, 0.6]),
        ] {
            assert_eq!([R, G, B, A].map(|channel| min(channels, texels.clone(), channel)), expected);
            assert_eq!(min(channels, texels, Mean), 0.2);
        }
    }
}
