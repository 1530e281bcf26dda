//! Texel storage: the layouts of images, and access to single texels.

use std::ops::Range;

use glam::{Vec3, Vec4};

use crate::texture::srgb;

/// Weight of the colour of fully transparent texels, so that all-transparent regions keep a colour.
pub(super) const MIN_ALPHA_WEIGHT: f32 = 1e-4;

/// The channels of an image, as its file stores them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    /// Grey.
    L = 1,
    /// Grey and alpha.
    La = 2,
    /// Red, green and blue.
    Rgb = 3,
    /// Red, green, blue and alpha, not premultiplied.
    Rgba = 4,
}

/// The values of an image: row-major, row 0 on top, channels interleaved.
#[derive(Clone, Debug)]
pub enum Texels {
    /// 8 bits a channel.
    U8(Vec<u8>),
    /// 16 bits a channel.
    U16(Vec<u16>),
}

/// The meaning of the values of a texture, which determines how they are filtered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelSemantics {
    /// sRGB-encoded colours. An alpha channel is unused, or used separately.
    Color,
    /// sRGB-encoded colours that filtering weights by alpha: transparent texels do not contribute.
    AlphaWeightedColor,
    /// Linear data.
    Data,
    /// Vectors of a normal map. Lookups give the mean vector and the variance of slopes
    /// ([`Texture::sample_normal_map`](crate::Texture::sample_normal_map)).
    Normal,
}

impl TexelSemantics {
    /// True if texels are encoded in sRGB.
    #[inline(always)]
    pub(super) fn is_color(self) -> bool {
        matches!(self, TexelSemantics::Color | TexelSemantics::AlphaWeightedColor)
    }
}

/// A channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextureChannel {
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha.
    A,
    /// Mean of red, green and blue.
    Mean,
}

impl TextureChannel {
    /// The channel of a texel.
    #[inline(always)]
    pub fn of(self, texel: Vec4) -> f32 {
        match self {
            TextureChannel::R => texel.x,
            TextureChannel::G => texel.y,
            TextureChannel::B => texel.z,
            TextureChannel::A => texel.w,
            TextureChannel::Mean => (texel.x + texel.y + texel.z) / 3.0,
        }
    }
}

/// A view of the texels of an image or of one of its mip levels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TexelView<'a> {
    pub width: u32,
    pub height: u32,
    pub channels: Channels,
    pub texels: &'a Texels,
}

impl TexelView<'_> {
    /// Returns texel `i` of the row-major list as stored, in 0…1: neither decoded nor filtered. Grey
    /// fills all three colours; a missing alpha is 1.
    #[inline]
    pub fn stored(&self, i: usize) -> Vec4 {
        let [texel] = self.stored_many([i]);
        texel
    }

    /// Returns texel `i` with colours decoded from sRGB. Alpha is always linear.
    #[inline]
    pub fn decoded(&self, i: usize) -> Vec4 {
        let [texel] = self.decoded_many([i]);
        texel
    }

    /// Returns several texels as [`TexelView::stored`] does. Dispatches once on the layout.
    #[inline(always)]
    pub fn stored_many<const N: usize>(&self, indices: [usize; N]) -> [Vec4; N] {
        let (mut texels, max) = match &self.texels {
            Texels::U8(t) => (self.convert_many(t, indices, 255.0, f32::from, f32::from), 255.0),
            Texels::U16(t) => (self.convert_many(t, indices, 65535.0, f32::from, f32::from), 65535.0),
        };
        for texel in &mut texels {
            *texel /= max;
        }
        texels
    }

    /// Returns several texels as [`TexelView::decoded`] does. Dispatches once on the layout.
    #[inline(always)]
    pub fn decoded_many<const N: usize>(&self, indices: [usize; N]) -> [Vec4; N] {
        match &self.texels {
            Texels::U8(t) => {
                let table = srgb::decode_table_8();
                self.convert_many(t, indices, 1.0, |c| table[usize::from(c)], |a| f32::from(a) / 255.0)
            }
            Texels::U16(t) => {
                let table = srgb::decode_table_16();
                self.convert_many(t, indices, 1.0, |c| table[usize::from(c)], |a| f32::from(a) / 65535.0)
            }
        }
    }

    /// Converts several texels. `opaque` stands in for a missing alpha.
    #[inline(always)]
    fn convert_many<T: Copy, const N: usize>(
        &self,
        texels: &[T],
        indices: [usize; N],
        opaque: f32,
        color: impl Fn(T) -> f32,
        alpha: impl Fn(T) -> f32,
    ) -> [Vec4; N] {
        // Loops: the closures of `array::map` and `for_each` are not always inlined.
        let mut out = [Vec4::ZERO; N];
        match self.channels {
            Channels::L => {
                for k in 0..N {
                    out[k] = Vec3::splat(color(texels[indices[k]])).extend(opaque);
                }
            }
            Channels::La => {
                for k in 0..N {
                    let &[l, a] = channels(texels, indices[k]);
                    out[k] = Vec3::splat(color(l)).extend(alpha(a));
                }
            }
            Channels::Rgb => {
                for k in 0..N {
                    let &[r, g, b] = channels(texels, indices[k]);
                    out[k] = Vec4::new(color(r), color(g), color(b), opaque);
                }
            }
            Channels::Rgba => {
                for k in 0..N {
                    let &[r, g, b, a] = channels(texels, indices[k]);
                    out[k] = Vec4::new(color(r), color(g), color(b), alpha(a));
                }
            }
        }
        out
    }

    /// Copies a channel of some texels of the row-major list as stored, in 0…1.
    pub fn copy_channel(&self, texels: Range<usize>, channel: usize, to: &mut [f32]) {
        match self.texels {
            Texels::U8(all) => self.copy_values(all, texels, channel, |v| f32::from(v) / 255.0, to),
            Texels::U16(all) => self.copy_values(all, texels, channel, |v| f32::from(v) / 65535.0, to),
        }
    }

    fn copy_values<T: Copy>(
        &self,
        all: &[T],
        texels: Range<usize>,
        channel: usize,
        value: impl Fn(T) -> f32 + Copy,
        to: &mut [f32],
    ) {
        match self.channels {
            Channels::L => copy_from(&all.as_chunks::<1>().0[texels], channel, value, to),
            Channels::La => copy_from(&all.as_chunks::<2>().0[texels], channel, value, to),
            Channels::Rgb => copy_from(&all.as_chunks::<3>().0[texels], channel, value, to),
            Channels::Rgba => copy_from(&all.as_chunks::<4>().0[texels], channel, value, to),
        }
    }

    /// Returns the alpha of texel `i`.
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

/// Returns the channels of texel `i`.
#[inline(always)]
fn channels<T: Copy, const CHANNELS: usize>(texels: &[T], i: usize) -> &[T; CHANNELS] {
    let (texels, _) = texels.as_chunks();
    &texels[i]
}

fn copy_from<T: Copy, const CHANNELS: usize>(
    texels: &[[T; CHANNELS]],
    channel: usize,
    value: impl Fn(T) -> f32,
    to: &mut [f32],
) {
    for (to, texel) in to.iter_mut().zip(texels) {
        *to = value(texel[channel.min(CHANNELS - 1)]);
    }
}
