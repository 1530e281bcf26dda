//! Decoded images with their mip maps.

use glam::Vec4;

use crate::texture::max_mip::MaxMip;
use crate::texture::min_mip::MinMip;
use crate::texture::mips::MipMaps;
use crate::texture::texels::{Channels, TexelView, Texels, TextureChannel};

/// A decoded image. Its use decides whether the colours are sRGB-encoded
/// ([`TexelSemantics`](crate::TexelSemantics)).
#[derive(Clone, Debug)]
pub struct Image {
    /// Name, or file name.
    pub name: String,
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Channels of a texel.
    pub channels: Channels,
    /// `width · height` texels.
    pub texels: Texels,
    /// Mip maps, computed on first use.
    pub mips: MipMaps,
}

impl Image {
    /// Returns the size of the texels in bytes.
    pub fn byte_size(&self) -> u64 {
        match &self.texels {
            Texels::U8(t) => t.len() as u64,
            Texels::U16(t) => 2 * t.len() as u64,
        }
    }

    /// Returns texel `i` of the row-major list as stored, in 0…1: neither decoded nor filtered. Grey
    /// fills all three colours; a missing alpha is 1.
    pub fn stored(&self, i: usize) -> Vec4 {
        self.view().stored(i)
    }

    /// Returns texel `i` of the row-major list as linear light, decoded from sRGB.
    pub fn decoded(&self, i: usize) -> Vec4 {
        self.view().decoded(i)
    }

    /// Returns the min-mip pyramid of a channel.
    pub(crate) fn min_mip(&self, channel: TextureChannel) -> &MinMip {
        self.mips.min_mip(self.view(), channel)
    }

    /// Returns the max-mip pyramid of a channel.
    pub(crate) fn max_mip(&self, channel: TextureChannel) -> &MaxMip {
        self.mips.max_mip(self.view(), channel)
    }

    /// Returns the texels at full resolution.
    pub(crate) fn view(&self) -> TexelView<'_> {
        TexelView { width: self.width, height: self.height, channels: self.channels, texels: &self.texels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::srgb_to_linear;

    /// An image of two texels in a row.
    fn image(channels: Channels, texels: Texels) -> Image {
        Image { name: String::new(), width: 2, height: 1, channels, texels, mips: MipMaps::default() }
    }

    #[test]
    fn every_layout_expands_to_four_channels() {
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
            assert!(image.view().decoded(1).abs_diff_eq(decoded.into(), 1e-7), "{image:?}");
        }
    }
}
