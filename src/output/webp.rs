//! WebP without loss: 8 bits, straight alpha, sRGB.

use std::io;

use image_webp::{ColorType, WebPEncoder};

/// Encodes 8-bit RGBA; without an alpha channel where all is opaque.
pub(super) fn encode(
    (width, height): (u32, u32),
    pixels: &[[u8; 4]],
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = WebPEncoder::new(&mut out);
    if let Some(fingerprint) = fingerprint {
        encoder.set_xmp_metadata(super::metadata::xmp(fingerprint));
    }
    let written = match super::opaque(pixels) {
        Some(rgb) => encoder.encode(&rgb, width, height, ColorType::Rgb8),
        None => encoder.encode(pixels.as_flattened(), width, height, ColorType::Rgba8),
    };
    written.map_err(io::Error::other)?;
    Ok(out)
}
