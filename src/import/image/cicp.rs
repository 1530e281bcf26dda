//! The colour space that a PNG names in its cICP chunk, as code points of ITU-T H.273.

use glam::Vec3;

use blinn_scene::{Channels, Image, MipMaps, Texels, linear_to_srgb, srgb_to_linear};

/// Curve of an image's values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Transfer {
    Linear,
    Srgb,
    /// A power of 2.4, the display of ITU-R BT.1886.
    Bt1886,
    /// Perceptual quantizer of ITU-R BT.2100.
    Pq,
    /// Hybrid log-gamma of ITU-R BT.2100, on a display of 1,000 cd/m².
    Hlg,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Primaries {
    Rec709,
    DisplayP3,
    Rec2020,
}

/// A colour space other than sRGB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ColorSpace {
    primaries: Primaries,
    transfer: Transfer,
}

/// White of HDR images, cd/m² (ITU-R BT.2408).
const HDR_WHITE: f32 = 203.0;

/// Largest luminance of the display of hybrid log-gamma, cd/m².
const HLG_PEAK: f32 = 1000.0;

impl ColorSpace {
    /// Returns the colour space of a PNG; `None` for sRGB, for files without the chunk and for spaces that Blender does not
    /// know either. Its full-range flag is ignored: PNG has full range.
    pub fn of_png(bytes: &[u8]) -> Option<ColorSpace> {
        use {Primaries as P, Transfer as T};
        let &[primaries, transfer, 0, _] = chunk_before_data(bytes, b"cICP")? else { return None };
        let (primaries, transfer) = match (primaries, transfer) {
            (1, 1) => (P::Rec709, T::Bt1886),
            (1, 8) => (P::Rec709, T::Linear),
            (9, 1) => (P::Rec2020, T::Bt1886),
            (9, 16) => (P::Rec2020, T::Pq),
            (9, 18) => (P::Rec2020, T::Hlg),
            (12, 1 | 13) => (P::DisplayP3, T::Srgb),
            _ => return None,
        };
        Some(ColorSpace { primaries, transfer })
    }

    /// Returns an image in this space as one in sRGB, with 16 bits. Colours out of its range are clamped.
    pub fn to_srgb(self, image: &Image) -> Image {
        let count = image.width as usize * image.height as usize;
        let curve: Vec<f32> = match &image.texels {
            Texels::U8(_) => (0..=u8::MAX).map(|v| self.transfer.decode(f32::from(v) / 255.0)).collect(),
            Texels::U16(_) => (0..=u16::MAX).map(|v| self.transfer.decode(f32::from(v) / 65535.0)).collect(),
        };
        let max = (curve.len() - 1) as f32;
        let to_16_bits = |v: f32| (v * 65535.0 + 0.5) as u16;
        let mut texels = Vec::with_capacity(count * 4);
        for i in 0..count {
            let stored = image.stored(i);
            let decoded = Vec3::from(stored.truncate().to_array().map(|v| curve[(v * max + 0.5) as usize]));
            let linear = self.primaries.to_rec709(self.transfer.to_display(decoded));
            texels.extend(
                linear.clamp(Vec3::ZERO, Vec3::ONE).to_array().map(|v| to_16_bits(linear_to_srgb(v))),
            );
            texels.push(to_16_bits(stored.w));
        }
        let Image { name, width, height, .. } = image;
        Image {
            name: name.clone(),
            width: *width,
            height: *height,
            channels: Channels::Rgba,
            texels: Texels::U16(texels),
            mips: MipMaps::default(),
        }
    }
}

impl Transfer {
    /// Decodes a component. The result is linear light, 1 at white; of hybrid log-gamma that of the scene.
    fn decode(self, v: f32) -> f32 {
        match self {
            Transfer::Linear => v,
            Transfer::Srgb => srgb_to_linear(v),
            Transfer::Bt1886 => libm::powf(v, 2.4),
            Transfer::Pq => {
                const M1: f32 = 2610.0 / 16384.0;
                const M2: f32 = 2523.0 / 32.0;
                const C1: f32 = 107.0 / 128.0;
                const C2: f32 = 2413.0 / 128.0;
                const C3: f32 = 2392.0 / 128.0;
                let p = libm::powf(v, 1.0 / M2);
                let light = libm::powf((p - C1).max(0.0) / (C2 - C3 * p), 1.0 / M1);
                light * 10_000.0 / HDR_WHITE
            }
            Transfer::Hlg => {
                const A: f32 = 0.178_832_77;
                const B: f32 = 0.284_668_92;
                const C: f32 = 0.559_910_7;
                if v <= 0.5 { v * v / 3.0 } else { (libm::expf((v - C) / A) + B) / 12.0 }
            }
        }
    }

    /// Turns decoded components to the light of the display.
    fn to_display(self, decoded: Vec3) -> Vec3 {
        if self != Transfer::Hlg {
            return decoded;
        }
        let luminance = decoded.dot(Vec3::new(0.2627, 0.678, 0.0593));
        decoded * libm::powf(luminance, 0.2) * (HLG_PEAK / HDR_WHITE)
    }
}

impl Primaries {
    /// Turns linear light to that of the primaries of sRGB.
    fn to_rec709(self, light: Vec3) -> Vec3 {
        let rows = match self {
            Primaries::Rec709 => return light,
            Primaries::DisplayP3 => [
                [1.224_940_1, -0.224_940_1, 0.0],
                [-0.042_056_9, 1.042_057, 0.0],
                [-0.019_637_6, -0.078_636_1, 1.098_273_7],
            ],
            Primaries::Rec2020 => [
                [1.660_491, -0.587_641_1, -0.072_849_9],
                [-0.124_550_5, 1.132_9, -0.008_349_4],
                [-0.018_150_8, -0.100_578_9, 1.118_729_7],
            ],
        };
        Vec3::from(rows.map(|row: [f32; 3]| Vec3::from(row).dot(light)))
    }
}

/// Returns the content of the first chunk of this type before the image data of a PNG.
fn chunk_before_data<'b>(bytes: &'b [u8], kind: &[u8; 4]) -> Option<&'b [u8]> {
    let mut rest = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n")?;
    loop {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (name, after) = after.split_first_chunk::<4>()?;
        let length = usize::try_from(u32::from_be_bytes(*length)).ok()?;
        if name == kind {
            return after.get(..length);
        }
        if name == b"IDAT" {
            return None;
        }
        // The checksum follows.
        rest = after.get(length.checked_add(4)?..)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(chunk: &[u8]) -> Vec<u8> {
        let ihdr = [&13u32.to_be_bytes()[..], b"IHDR", &[0; 17]].concat();
        let cicp = [&(chunk.len() as u32).to_be_bytes()[..], b"cICP", chunk, &[0; 4]].concat();
        [&b"\x89PNG\r\n\x1a\n"[..], &ihdr, &cicp, &0u32.to_be_bytes(), b"IDAT"].concat()
    }

    fn shown(chunk: [u8; 4], texels: Texels) -> Vec3 {
        let image = Image {
            name: String::new(),
            width: 1,
            height: 1,
            channels: Channels::Rgb,
            texels,
            mips: MipMaps::default(),
        };
        ColorSpace::of_png(&png(&chunk)).unwrap().to_srgb(&image).decoded(0).truncate()
    }

    /// Blender 5.0.1 reads these colours from (200, 100, 50) and (20, 120, 250); those out of range are clamped here.
    #[test]
    fn colours_are_blenders() {
        for (primaries, transfer, first, second) in [
            (1, 1, [0.5582, 0.1058, 0.02], [0.0022, 0.1638, 0.9536]),
            (12, 13, [0.6788, 0.1085, 0.0137], [-0.0337, 0.1954, 1.035]),
            (12, 1, [0.6788, 0.1085, 0.0137], [-0.0337, 0.1954, 1.035]),
            (9, 1, [0.8633, 0.0501, 0.0016], [-0.162, 0.1773, 1.0503]),
            (9, 16, [10.9305, -0.6604, -0.1226], [-3.1744, 0.0408, 45.6921]),
            (9, 18, [1.5874, 0.0598, 0.0111], [-0.3302, 0.2376, 3.1251]),
            (1, 8, [0.7843, 0.3922, 0.1961], [0.0784, 0.4706, 0.9804]),
        ] {
            for (rgb, expected) in [([200u8, 100, 50], first), ([20, 120, 250], second)] {
                let expected = Vec3::from(expected).clamp(Vec3::ZERO, Vec3::ONE);
                let chunk = [primaries, transfer, 0, 1];
                for texels in
                    [Texels::U8(rgb.to_vec()), Texels::U16(rgb.map(|v| u16::from(v) * 257).to_vec())]
                {
                    let found = shown(chunk, texels);
                    assert!(found.abs_diff_eq(expected, 3e-4), "{chunk:?} {rgb:?}: {found}");
                }
            }
        }
    }

    #[test]
    fn other_spaces_are_ignored() {
        for chunk in [&[1, 13, 0, 1][..], &[12, 13, 1, 1], &[12, 4, 0, 1], &[12, 13, 0], &[]] {
            assert_eq!(ColorSpace::of_png(&png(chunk)), None, "{chunk:?}");
        }
        let good = png(&[12, 13, 0, 1]);
        assert!((0..good.len() - 12).all(|end| ColorSpace::of_png(&good[..end]).is_none()));
        let late = [&good[..33], &good[good.len() - 8..], &good[33..]].concat();
        assert_eq!(ColorSpace::of_png(&late), None);
    }
}
