//! The least numbers in parts of an image: a pyramid of minima, to bound what a lookup can find.

use std::ops::Range;

use crate::scene::material::TextureChannel;
use crate::scene::texture::image::{TexelView, Texels};

/// Texels along a side of the smallest cells are two to this.
const FINEST: u32 = 2;
/// Cells along a side of a part that are looked at, at most.
const MOST: usize = 4;

/// The least of a channel in square cells, each level's twice as wide and high as those of the one before.
#[derive(Clone, Debug)]
pub(crate) struct MinMip {
    levels: Vec<Cells>,
    /// The number that stands for 1.
    one: f32,
}

#[derive(Clone, Debug)]
struct Cells {
    width: usize,
    /// As the image stores its numbers.
    least: Vec<u16>,
}

impl Cells {
    /// Of cells of `2^shift` by `2^shift` texels of rows of `width`, each of `channels` numbers that `of`
    /// makes one of.
    fn new<T: Copy>(
        texels: &[T],
        (width, channels): (usize, usize),
        shift: u32,
        of: impl Fn(&[T]) -> u16,
    ) -> Cells {
        let rows = texels.chunks_exact((width * channels).max(1));
        let across = width.div_ceil(1 << shift);
        let mut least = vec![u16::MAX; across * rows.len().div_ceil(1 << shift)];
        for (y, row) in rows.enumerate() {
            let cells = &mut least[(y >> shift) * across..][..across];
            for (least, texels) in cells.iter_mut().zip(row.chunks(channels << shift)) {
                *least = texels.chunks_exact(channels).map(&of).fold(*least, u16::min);
            }
        }
        Cells { width: across, least }
    }
}

impl MinMip {
    pub fn new(image: TexelView, channel: TextureChannel) -> MinMip {
        let size = (image.width as usize, image.channels as usize);
        let (finest, one) = match image.texels {
            Texels::U8(texels) => (finest(texels, size, channel, u8::MAX), u16::from(u8::MAX)),
            Texels::U16(texels) => (finest(texels, size, channel, u16::MAX), u16::MAX),
        };
        let mut levels = vec![finest];
        while let Some(finer) = levels.last().filter(|finer| finer.least.len() > 1) {
            levels.push(Cells::new(&finer.least, (finer.width, 1), 1, |one| one[0]));
        }
        MinMip { levels, one: f32::from(one) }
    }

    /// Of all of the image.
    pub fn of_all(&self) -> f32 {
        self.levels.last().and_then(|top| top.least.first()).map_or(f32::INFINITY, |&top| self.number(top))
    }

    /// At most the least of texels `x` by `y`; infinite of none.
    pub fn over(&self, x: &Range<usize>, y: &Range<usize>) -> f32 {
        if x.is_empty() || y.is_empty() {
            return f32::INFINITY;
        }
        let cells = |of: &Range<usize>, level: usize| {
            let shift = FINEST as usize + level;
            of.start >> shift..((of.end - 1) >> shift) + 1
        };
        let few = |level: &usize| cells(x, *level).len().max(cells(y, *level).len()) <= MOST;
        let level = (0..self.levels.len()).find(few).unwrap_or(self.levels.len() - 1);
        let Cells { width, least } = &self.levels[level];
        let rows = cells(y, level).flat_map(|row| &least[row * width..][cells(x, level)]);
        rows.min().map_or(f32::INFINITY, |&least| self.number(least))
    }

    fn number(&self, stored: u16) -> f32 {
        f32::from(stored) / self.one
    }
}

/// The finest cells of an image whose texels have `channels` numbers, of which `one` is the greatest.
fn finest<T: Copy + Into<u16>>(texels: &[T], size: (usize, usize), channel: TextureChannel, one: T) -> Cells {
    let channels = size.1;
    let colors = if channels < 3 { 1 } else { 3 };
    let nth = match channel {
        TextureChannel::R => 0,
        TextureChannel::G => 1.min(colors - 1),
        TextureChannel::B => colors - 1,
        TextureChannel::A if channels == colors => return Cells::new(texels, size, FINEST, |_| one.into()),
        TextureChannel::A => channels - 1,
        // At most the mean.
        TextureChannel::Mean => {
            let least = |texel: &[T]| texel[..colors].iter().map(|&c| c.into()).min().unwrap_or(0);
            return Cells::new(texels, size, FINEST, least);
        }
    };
    Cells::new(texels, size, FINEST, |texel| texel[nth].into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Channels, Texels};

    /// Never more than the least that is there, nearly always just that, and exactly that of all.
    #[test]
    fn parts_are_bounded_from_below() {
        for (width, height) in [(1u32, 1u32), (4, 4), (5, 3), (64, 64), (37, 90), (1, 300)] {
            let values: Vec<u8> =
                (0..width * height).map(|i| if i % 61 == 60 { (i % 7) as u8 } else { 255 }).collect();
            let texels = Texels::U8(values.clone());
            let plane = TexelView { width, height, channels: Channels::L, texels: &texels };
            let lowest = MinMip::new(plane, TextureChannel::R);
            let (w, h) = (width as usize, height as usize);
            let least = |x: Range<usize>, y: Range<usize>| {
                let at = |y: usize| values[y * w..][x.clone()].iter().min().copied();
                f32::from(y.filter_map(at).min().unwrap_or(255)) / 255.0
            };
            assert_eq!(lowest.of_all(), least(0..w, 0..h));
            let mut close = 0;
            let all: Vec<_> = (0..400).map(|i| (i * 7 % w, i * 11 % h, 1 + i % 9, 1 + i % 5)).collect();
            for &(x, y, across, down) in &all {
                let (x, y) = (x..(x + across).min(w), y..(y + down).min(h));
                let (found, exact) = (lowest.over(&x, &y), least(x.clone(), y.clone()));
                assert!(found <= exact, "{x:?} {y:?} of {width} x {height}");
                close += usize::from(found == exact);
            }
            assert!(close > all.len() / 2, "{close} of {} in {width} x {height}", all.len());
            assert_eq!(lowest.over(&(0..0), &(0..1)), f32::INFINITY);
        }
    }

    #[test]
    fn every_layout_has_its_channels() {
        use TextureChannel::{A, B, G, Mean, R};
        let least = |channels, texels, channel| {
            let plane = TexelView { width: 2, height: 1, channels, texels: &texels };
            MinMip::new(plane, channel).of_all()
        };
        let eight = |texels: &[u8]| Texels::U8(texels.to_vec());
        for (channels, texels, expected) in [
            (Channels::L, eight(&[51, 102]), [0.2, 0.2, 0.2, 1.0]),
            (Channels::La, eight(&[51, 204, 102, 153]), [0.2, 0.2, 0.2, 0.6]),
            (Channels::Rgb, eight(&[51, 255, 204, 102, 153, 255]), [0.2, 0.6, 0.8, 1.0]),
            (Channels::Rgba, eight(&[51, 255, 204, 102, 153, 153, 255, 51]), [0.2, 0.6, 0.8, 0.2]),
            (Channels::La, Texels::U16(vec![13107, 52428, 26214, 39321]), [0.2, 0.2, 0.2, 0.6]),
        ] {
            assert_eq!([R, G, B, A].map(|channel| least(channels, texels.clone(), channel)), expected);
            assert_eq!(least(channels, texels, Mean), 0.2);
        }
    }
}
