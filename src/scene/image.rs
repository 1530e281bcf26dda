//! Images: texels as their files stored them, and what they decode to.

use std::sync::OnceLock;

use glam::{Vec3, Vec4};

use super::mips::Mips;

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
/// ([`Reading`](super::Reading)).
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
    pub mips: Mips,
}

/// Rows of texels: an image, or one of its smaller copies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane<'a> {
    pub width: u32,
    pub height: u32,
    pub channels: Channels,
    pub texels: &'a Texels,
}

impl Image {
    /// Bytes of its texels.
    pub fn bytes(&self) -> u64 {
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

    /// The image at its finest.
    pub(super) fn plane(&self) -> Plane<'_> {
        Plane { width: self.width, height: self.height, channels: self.channels, texels: &self.texels }
    }
}

impl Plane<'_> {
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
                let table = srgb_table();
                spread(&t[n * i..][..n], 1.0, |c| table[usize::from(c)], |a| f32::from(a) / 255.0)
            }
            Texels::U16(t) => {
                let table = srgb_table_16();
                spread(&t[n * i..][..n], 1.0, |c| table[usize::from(c)], |a| f32::from(a) / 65535.0)
            }
        }
    }
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

/// IEC 61966-2-1: an encoded value in 0…1 to linear light.
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

/// The way back: linear light in 0…1 to an encoded value.
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 }
}

/// Colours, not alpha, from sRGB to linear light.
pub(super) fn decode_colors(v: Vec4) -> Vec4 {
    Vec4::new(decode(v.x), decode(v.y), decode(v.z), v.w)
}

/// [`srgb_to_linear`] between two codes of 8 bits, within 1e-5 of it.
pub(super) fn decode(v: f32) -> f32 {
    let x = (v * 255.0).clamp(0.0, 255.0);
    let low = (x as usize).min(254);
    let [a, b] = [srgb_table()[low], srgb_table()[low + 1]];
    a + (b - a) * (x - low as f32)
}

/// The nearest of the 8-bit codes for linear light.
pub(super) fn encode_8(v: f32) -> u8 {
    /// Where each code gives way to the next, and the code at each of so many steps of light.
    struct Codes {
        ends: [f32; 255],
        first: [u8; STEPS + 1],
    }
    const STEPS: usize = 4095;
    static CODES: OnceLock<Codes> = OnceLock::new();
    let codes = CODES.get_or_init(|| {
        let ends = std::array::from_fn(|i| srgb_to_linear((i as f32 + 0.5) / 255.0));
        let below = |i: usize| ends.partition_point(|&end: &f32| end <= i as f32 / STEPS as f32);
        Codes { ends, first: std::array::from_fn(|i| below(i) as u8) }
    });
    let mut code = codes.first[(v.clamp(0.0, 1.0) * STEPS as f32) as usize];
    while code < 255 && v >= codes.ends[usize::from(code)] {
        code += 1;
    }
    code
}

fn srgb_table() -> &'static [f32; 256] {
    static TABLE: OnceLock<[f32; 256]> = OnceLock::new();
    TABLE.get_or_init(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)))
}

fn srgb_table_16() -> &'static [f32] {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    TABLE.get_or_init(|| (0..=u16::MAX).map(|i| srgb_to_linear(f32::from(i) / 65535.0)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two texels side by side.
    fn image(channels: Channels, texels: Texels) -> Image {
        Image { name: String::new(), width: 2, height: 1, channels, texels, mips: Mips::default() }
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

    #[test]
    fn decoding_between_codes_is_near() {
        for i in 0..=4096 {
            let v = i as f32 / 4096.0;
            assert!((decode(v) - srgb_to_linear(v)).abs() < 1e-5, "{v}");
        }
    }

    #[test]
    fn encoding_finds_the_nearest_code() {
        for i in 0..=100_000 {
            let v = i as f32 / 100_000.0;
            let exact = linear_to_srgb(v) * 255.0;
            assert!((exact - f32::from(encode_8(v))).abs() < 0.501, "{v}: {exact}");
        }
        for code in 0..=255u8 {
            assert_eq!(encode_8(srgb_to_linear(f32::from(code) / 255.0)), code);
        }
        assert_eq!((encode_8(0.5), encode_8(f32::NAN), encode_8(2.0)), (188, 0, 255));
    }
}
