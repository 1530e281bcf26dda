//! Images: texels as their files stored them, and what they decode to.

use glam::{Vec3, Vec4};

use crate::scene::material::TextureChannel;
use crate::scene::texture::min_mip::MinMip;
use crate::scene::texture::mips::MipMaps;
use crate::scene::texture::srgb;

/// What an image's channels hold, as its file stored them: nothing is widened on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Grey.
    L = 1,
    /// Grey and alpha.
    La = 2,
    /// Red, green and blue.
    Rgb = 3,
    /// Red, green, blue and alpha; not premultiplied.
    Rgba = 4,
}

/// The numbers of an image: row-major, row 0 on top, the channels of a texel side by side.
#[derive(Clone, Debug)]
pub enum Texels {
    /// 8 bits a channel.
    U8(Vec<u8>),
    /// 16 bits a channel.
    U16(Vec<u16>),
}

/// A decoded image. Whether its colours are sRGB-encoded is for whoever looks it up to say
/// ([`TexelSemantics`](crate::scene::TexelSemantics)).
#[derive(Clone, Debug)]
pub struct Image {
    /// Its name or file name.
    pub name: String,
    /// Texels to the right.
    pub width: u32,
    /// Texels downwards.
    pub height: u32,
    /// What a texel has.
    pub channels: Channels,
    /// `width · height` texels of that many channels.
    pub texels: Texels,
    /// Its smaller copies, made when they are first asked for.
    pub mips: MipMaps,
}

/// Rows of texels: an image, or one of its smaller copies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelView<'a> {
    pub width: u32,
    pub height: u32,
    pub channels: Channels,
    pub texels: &'a Texels,
}

impl Image {
    /// Bytes of its texels.
    pub fn byte_size(&self) -> u64 {
        match &self.texels {
            Texels::U8(t) => t.len() as u64,
            Texels::U16(t) => 2 * t.len() as u64,
        }
    }

    /// Texel `i` of the row-major list as stored: red, green, blue, alpha in 0…1, neither decoded
    /// nor filtered. Grey is all three colours; alpha is 1 where there is none.
    pub fn stored(&self, i: usize) -> Vec4 {
        self.plane().stored(i)
    }

    /// The least of a channel in its parts.
    pub(crate) fn lowest(&self, channel: TextureChannel) -> &MinMip {
        self.mips.lowest(self.plane(), channel)
    }

    /// The image at its finest.
    pub(crate) fn plane(&self) -> TexelView<'_> {
        TexelView { width: self.width, height: self.height, channels: self.channels, texels: &self.texels }
    }
}

impl TexelView<'_> {
    /// [`Image::stored`].
    pub fn stored(&self, i: usize) -> Vec4 {
        let n = self.channels as usize;
        match &self.texels {
            Texels::U8(t) => spread(&t[n * i..][..n], 255.0, f32::from, f32::from) / 255.0,
            Texels::U16(t) => spread(&t[n * i..][..n], 65535.0, f32::from, f32::from) / 65535.0,
        }
    }

    /// The same with colours decoded from sRGB; alpha is linear always.
    pub fn decoded(&self, i: usize) -> Vec4 {
        let n = self.channels as usize;
        match &self.texels {
            Texels::U8(t) => {
                let table = srgb::from_8();
                spread(&t[n * i..][..n], 1.0, |c| table[usize::from(c)], |a| f32::from(a) / 255.0)
            }
            Texels::U16(t) => {
                let table = srgb::from_16();
                spread(&t[n * i..][..n], 1.0, |c| table[usize::from(c)], |a| f32::from(a) / 65535.0)
            }
        }
    }

    /// [`TexelView::stored`] of several texels, for those who look at all there are.
    #[inline(always)]
    pub fn all_stored<const N: usize>(&self, at: [usize; N]) -> [Vec4; N] {
        match &self.texels {
            Texels::U8(t) => self.all(t, at, 255.0, f32::from, f32::from).map(|texel| texel / 255.0),
            Texels::U16(t) => self.all(t, at, 65535.0, f32::from, f32::from).map(|texel| texel / 65535.0),
        }
    }

    /// [`TexelView::decoded`] of several texels.
    #[inline(always)]
    pub fn all_decoded<const N: usize>(&self, at: [usize; N]) -> [Vec4; N] {
        match &self.texels {
            Texels::U8(t) => {
                let table = srgb::from_8();
                self.all(t, at, 1.0, |c| table[usize::from(c)], |a| f32::from(a) / 255.0)
            }
            Texels::U16(t) => {
                let table = srgb::from_16();
                self.all(t, at, 1.0, |c| table[usize::from(c)], |a| f32::from(a) / 65535.0)
            }
        }
    }

    /// Asks what texels have once, for all of them.
    #[inline(always)]
    fn all<T: Copy, const N: usize>(
        &self,
        texels: &[T],
        at: [usize; N],
        opaque: f32,
        color: impl Fn(T) -> f32,
        alpha: impl Fn(T) -> f32,
    ) -> [Vec4; N] {
        match self.channels {
            Channels::L => at.map(|i| Vec3::splat(color(texels[i])).extend(opaque)),
            Channels::La => at.map(|i| {
                let [l, a] = channels(texels, i);
                Vec3::splat(color(l)).extend(alpha(a))
            }),
            Channels::Rgb => at.map(|i| {
                let [r, g, b] = channels(texels, i);
                Vec4::new(color(r), color(g), color(b), opaque)
            }),
            Channels::Rgba => at.map(|i| {
                let [r, g, b, a] = channels(texels, i);
                Vec4::new(color(r), color(g), color(b), alpha(a))
            }),
        }
    }

    /// Alpha alone.
    pub fn alpha(&self, i: usize) -> f32 {
        let n = self.channels as usize;
        let last = n * (i + 1) - 1;
        match (self.channels, &self.texels) {
            (Channels::L | Channels::Rgb, _) => 1.0,
            (_, Texels::U8(t)) => f32::from(t[last]) / 255.0,
            (_, Texels::U16(t)) => f32::from(t[last]) / 65535.0,
        }
    }
}

/// The numbers of texel `i`, which has so many.
#[inline(always)]
fn channels<T: Copy, const CHANNELS: usize>(texels: &[T], i: usize) -> [T; CHANNELS] {
    let from = &texels[CHANNELS * i..][..CHANNELS];
    std::array::from_fn(|channel| from[channel])
}

/// The four channels of a texel that has some of them.
#[inline]
fn spread<T: Copy>(texel: &[T], opaque: f32, color: impl Fn(T) -> f32, alpha: impl Fn(T) -> f32) -> Vec4 {
    match *texel {
        [l] => Vec3::splat(color(l)).extend(opaque),
        [l, a] => Vec3::splat(color(l)).extend(alpha(a)),
        [r, g, b] => Vec4::new(color(r), color(g), color(b), opaque),
        [r, g, b, a, ..] => Vec4::new(color(r), color(g), color(b), alpha(a)),
        [] => Vec4::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::srgb_to_linear;

    /// Two texels side by side.
    fn image(channels: Channels, texels: Texels) -> Image {
        Image { name: String::new(), width: 2, height: 1, channels, texels, mips: MipMaps::default() }
    }

    #[test]
    fn every_layout_is_read_as_four_channels() {
        let eight = |channels, texels: &[u8]| image(channels, Texels::U8(texels.to_vec()));
        let half = srgb_to_linear(51.0 / 255.0);
        for (image, stored, decoded) in [
            (eight(Channels::L, &[0, 51]), [0.2, 0.2, 0.2, 1.0], [half, half, half, 1.0]),
            (eight(Channels::La, &[0, 0, 51, 51]), [0.2; 4], [half, half, half, 0.2]),
            (eight(Channels::Rgb, &[0, 0, 0, 255, 0, 51]), [1.0, 0.0, 0.2, 1.0], [1.0, 0.0, half, 1.0]),
            (
                eight(Channels::Rgba, &[0, 0, 0, 0, 255, 0, 51, 51]),
                [1.0, 0.0, 0.2, 0.2],
                [1.0, 0.0, half, 0.2],
            ),
            (image(Channels::La, Texels::U16(vec![0, 0, 13107, 13107])), [0.2; 4], [half, half, half, 0.2]),
        ] {
            assert!(image.stored(1).abs_diff_eq(stored.into(), 1e-7), "{image:?}");
            assert!(image.plane().decoded(1).abs_diff_eq(decoded.into(), 1e-7), "{image:?}");
        }
    }
}
