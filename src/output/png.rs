//! PNG: straight alpha, sRGB.

use std::io;

/// Encodes 8-bit RGBA; without an alpha channel where all is opaque.
pub(super) fn encode8(
    size: (u32, u32),
    pixels: &[[u8; 4]],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    match super::opaque(pixels) {
        Some(rgb) => encode(size, (png::ColorType::Rgb, png::BitDepth::Eight), &rgb, fingerprint),
        None => {
            encode(size, (png::ColorType::Rgba, png::BitDepth::Eight), pixels.as_flattened(), fingerprint)
        }
    }
}

/// Encodes 16-bit RGBA; without an alpha channel where all is opaque.
pub(super) fn encode16(
    (width, height): (u32, u32),
    pixels: &[[u16; 4]],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let opaque = pixels.iter().all(|p| p[3] == u16::MAX);
    let channels = if opaque { 3 } else { 4 };
    let bytes: Vec<u8> =
        pixels.iter().flat_map(|p| p[..channels].iter().flat_map(|v| v.to_be_bytes())).collect();
    let color = if opaque { png::ColorType::Rgb } else { png::ColorType::Rgba };
    encode((width, height), (color, png::BitDepth::Sixteen), &bytes, fingerprint)
}

/// Encodes the red of 8-bit RGBA alone, as grey.
pub(super) fn encode_grey8(
    size: (u32, u32),
    pixels: &[[u8; 4]],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let bytes: Vec<u8> = pixels.iter().map(|p| p[0]).collect();
    encode(size, (png::ColorType::Grayscale, png::BitDepth::Eight), &bytes, fingerprint)
}

/// Encodes 16-bit numbers that are no colours.
pub(super) fn encode_grey16(
    size: (u32, u32),
    values: &[u16],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    encode(size, (png::ColorType::Grayscale, png::BitDepth::Sixteen), &bytes, fingerprint)
}

fn encode(
    (width, height): (u32, u32),
    (color, depth): (png::ColorType, png::BitDepth),
    bytes: &[u8],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    if let Some(fingerprint) = fingerprint {
        encoder.add_text_chunk(super::metadata::KEY.into(), fingerprint.into())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(out)
}
