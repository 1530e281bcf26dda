//! PNG: straight alpha, sRGB.

use std::io;

use ::png::{BitDepth, ColorType, Encoder, SrgbRenderingIntent, chunk};

use super::display_colors::DisplayColors;
use super::picture::FINGERPRINT_KEY;
use super::png_chunks::chunks;
use super::png_data::Rows;

/// Texts that a file stores before its pixels.
#[derive(Clone, Copy, Default)]
pub(super) struct Texts<'t> {
    pub fingerprint: Option<&'t str>,
    /// JSON object from ids to names.
    pub names: Option<&'t str>,
}

impl<'t> From<Option<&'t str>> for Texts<'t> {
    fn from(fingerprint: Option<&'t str>) -> Texts<'t> {
        Texts { fingerprint, names: None }
    }
}

/// The key of [`Texts::names`].
const NAMES_KEY: &str = "names";

/// The largest chunk (PNG specification, section 5.3).
const MAX_CHUNK_BYTES: usize = i32::MAX as usize;

/// Encodes straight 8-bit sRGB with alpha, row-major, row 0 on top.
///
/// # Errors
/// The encoder fails.
pub fn encode_png(size: (u32, u32), pixels: &[[u8; 4]]) -> io::Result<Vec<u8>> {
    encode_colors(size, &pixels.into(), None)
}

/// Encodes 8-bit colours, without the alpha channel if every pixel is opaque.
pub(super) fn encode_colors(
    size: (u32, u32),
    colors: &DisplayColors,
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let color = if colors.is_opaque() { ColorType::Rgb } else { ColorType::Rgba };
    encode(size, color, BitDepth::Eight, colors.bytes(), fingerprint)
}

/// Encodes 16-bit RGBA, without the alpha channel if every pixel is opaque.
pub(super) fn encode_rgba16(
    size: (u32, u32),
    pixels: &[[u16; 4]],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let opaque = pixels.iter().all(|p| p[3] == u16::MAX);
    let channels = if opaque { 3 } else { 4 };
    let bytes: Vec<u8> =
        pixels.iter().flat_map(|p| p[..channels].iter().flat_map(|v| v.to_be_bytes())).collect();
    let color = if opaque { ColorType::Rgb } else { ColorType::Rgba };
    encode(size, color, BitDepth::Sixteen, &bytes, fingerprint)
}

/// Encodes the red channel of 8-bit RGBA as greyscale.
pub(super) fn encode_grey8(
    size: (u32, u32),
    pixels: &[[u8; 4]],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let bytes: Vec<u8> = pixels.iter().map(|p| p[0]).collect();
    encode(size, ColorType::Grayscale, BitDepth::Eight, &bytes, fingerprint)
}

/// Encodes 8-bit greyscale, row-major, row 0 on top.
///
/// # Errors
/// The encoder fails.
pub fn encode_mask(size: (u32, u32), pixels: &[u8]) -> io::Result<Vec<u8>> {
    encode(size, ColorType::Grayscale, BitDepth::Eight, pixels, None)
}

/// Encodes 16-bit greyscale.
pub(super) fn encode_grey16<'t>(
    size: (u32, u32),
    values: &[u16],
    texts: impl Into<Texts<'t>>,
) -> io::Result<Vec<u8>> {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    encode(size, ColorType::Grayscale, BitDepth::Sixteen, &bytes, texts)
}

/// Encodes 8-bit indices into a palette of sRGB colours.
pub(super) fn encode_indexed(
    size: (u32, u32),
    indices: &[u8],
    palette: &[[u8; 3]],
    texts: Texts,
) -> io::Result<Vec<u8>> {
    encode_with(size, ColorType::Indexed, BitDepth::Eight, indices, texts, Some(palette))
}

fn encode<'t>(
    size: (u32, u32),
    color: ColorType,
    depth: BitDepth,
    bytes: &[u8],
    texts: impl Into<Texts<'t>>,
) -> io::Result<Vec<u8>> {
    encode_with(size, color, depth, bytes, texts.into(), None)
}

fn encode_with(
    (width, height): (u32, u32),
    color: ColorType,
    depth: BitDepth,
    bytes: &[u8],
    texts: Texts,
    palette: Option<&[[u8; 3]]>,
) -> io::Result<Vec<u8>> {
    let pixel_bytes = color.samples() * depth as usize / 8;
    let row_bytes = pixel_bytes * width as usize;
    if bytes.len() != row_bytes * height as usize {
        let message = format!("{width}x{height} pixels do not have {} bytes", bytes.len());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    // Greyscale images are masks, depths and ids: data, which colour management must not change.
    if color != ColorType::Grayscale {
        encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    }
    if let Some(palette) = palette {
        encoder.set_palette(palette.as_flattened().to_vec());
    }
    if let Some(fingerprint) = texts.fingerprint {
        encoder.add_text_chunk(FINGERPRINT_KEY.into(), fingerprint.into())?;
    }
    if let Some(names) = texts.names {
        encoder.add_itxt_chunk(NAMES_KEY.into(), names.into())?;
    }
    let mut writer = encoder.write_header()?;
    let data = Rows { bytes, row_bytes, pixel_bytes }.compress()?;
    for part in data.chunks(MAX_CHUNK_BYTES) {
        writer.write_chunk(chunk::IDAT, part)?;
    }
    writer.finish()?;
    Ok(out)
}

/// The fingerprint in a tEXt chunk before the image data.
pub(super) fn fingerprint(file: &[u8]) -> Option<Vec<u8>> {
    let text =
        |data: &[u8]| data.strip_prefix(FINGERPRINT_KEY.as_bytes())?.strip_prefix(&[0]).map(<[u8]>::to_vec);
    let before_data = chunks(file).take_while(|(name, _)| *name != b"IDAT");
    before_data.filter(|(name, _)| *name == b"tEXt").find_map(|(_, data)| text(data))
}

#[cfg(test)]
mod tests {
    use ::png::Compression;

    use super::*;

    /// The file that the crate `png` encodes.
    fn encoded_by_png(
        (width, height): (u32, u32),
        color: ColorType,
        depth: BitDepth,
        bytes: &[u8],
    ) -> Vec<u8> {
        let mut out = Vec::new();
        let mut encoder = Encoder::new(&mut out, width, height);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.set_compression(Compression::Fast);
        if color != ColorType::Grayscale {
            encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
        }
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(bytes).unwrap();
        writer.finish().unwrap();
        out
    }

    /// Small images are one block, large ones are compressed on all threads.
    #[test]
    fn files_are_those_of_the_crate_png_on_any_number_of_threads() {
        let kinds = [
            (ColorType::Rgb, BitDepth::Eight),
            (ColorType::Rgba, BitDepth::Eight),
            (ColorType::Grayscale, BitDepth::Eight),
            (ColorType::Grayscale, BitDepth::Sixteen),
            (ColorType::Rgba, BitDepth::Sixteen),
        ];
        for (color, depth) in kinds {
            for size in [(1, 1), (37, 5), (520, 510)] {
                let row = size.0 as usize * color.samples() * depth as usize / 8;
                // Each filter is the best for some rows.
                let byte = |i: usize| match i / row % 4 {
                    0 => 0,
                    1 => (i % row / 3) as u8,
                    2 => (i % 251 * i % 17) as u8,
                    _ => (i % row / 7 + i / row) as u8,
                };
                let bytes: Vec<u8> = (0..row * size.1 as usize).map(byte).collect();
                let expected = encoded_by_png(size, color, depth, &bytes);
                for threads in [1, 3] {
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                    let encoded = pool.install(|| encode(size, color, depth, &bytes, None).unwrap());
                    assert!(encoded == expected, "{color:?} {depth:?} {size:?} {threads} threads");
                }
            }
        }
    }

    #[test]
    fn wrong_sizes_are_errors() {
        for (size, count) in [((0, 0), 0), ((0, 5), 0), ((2, 2), 3), ((2, 2), 5)] {
            assert!(encode_mask(size, &vec![0; count]).is_err(), "{size:?} {count}");
        }
    }

    /// Depths and masks that colour management would change are no pictures.
    #[test]
    fn colours_alone_say_that_they_are_srgb() {
        let is_srgb = |file: Vec<u8>| chunks(&file).any(|(name, _)| name == b"sRGB");
        assert!(!is_srgb(encode_mask((1, 1), &[255]).unwrap()));
        assert!(!is_srgb(encode_grey16((1, 1), &[300], None).unwrap()));
        let palette = [[1, 2, 3]];
        assert!(is_srgb(encode_indexed((1, 1), &[0], &palette, Texts::default()).unwrap()));
    }
}
