//! JPEG: 8 bits, opaque, sRGB, colour at full resolution.

use std::io;

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};

/// Encodes opaque 8-bit RGBA with a quality of 1 to 100.
pub(super) fn encode(
    (width, height): (u32, u32),
    pixels: &[[u8; 4]],
    quality: u8,
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let Some(rgb) = super::opaque(pixels) else {
        let what = "a JPEG has no transparency: give a background, or write PNG or WebP";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    };
    let mut out = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut out, quality.clamp(1, 100));
    encoder.write_image(&rgb, width, height, ExtendedColorType::Rgb8).map_err(io::Error::other)?;
    if let Some(fingerprint) = fingerprint {
        super::metadata::into_jpeg(&mut out, fingerprint);
    }
    Ok(out)
}
