//! PNG: straight alpha, sRGB.

use std::io;

use ::png::{BitDepth, ColorType, Compression, Encoder, SrgbRenderingIntent};

use super::picture::{FINGERPRINT_KEY, opaque_rgb};
use super::png_chunks::chunks;

/// Encodes straight 8-bit sRGB with alpha, row-major, row 0 on top.
///
/// # Errors
/// The encoder fails.
pub fn encode_png(size: (u32, u32), pixels: &[[u8; 4]]) -> io::Result<Vec<u8>> {
    encode_rgba8(size, pixels, None)
}

/// Encodes 8-bit RGBA, without the alpha channel if every pixel is opaque.
pub(super) fn encode_rgba8(
    size: (u32, u32),
    pixels: &[[u8; 4]],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    match opaque_rgb(pixels) {
        Some(rgb) => encode(size, ColorType::Rgb, BitDepth::Eight, &rgb, fingerprint),
        None => encode(size, ColorType::Rgba, BitDepth::Eight, pixels.as_flattened(), fingerprint),
    }
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

/// Encodes 16-bit greyscale.
pub(super) fn encode_grey16(
    size: (u32, u32),
    values: &[u16],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    encode(size, ColorType::Grayscale, BitDepth::Sixteen, &bytes, fingerprint)
}

fn encode(
    (width, height): (u32, u32),
    color: ColorType,
    depth: BitDepth,
    bytes: &[u8],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(Compression::Fast);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    if let Some(fingerprint) = fingerprint {
        encoder.add_text_chunk(FINGERPRINT_KEY.into(), fingerprint.into())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
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
