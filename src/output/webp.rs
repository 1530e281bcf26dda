//! Lossless WebP: 8 bits, straight alpha, sRGB.

use std::io;

use image_webp::{ColorType, WebPEncoder};

use super::checksum::{seal, with_room};
use super::display_colors::DisplayColors;
use super::riff;

/// The XMP attribute before the fingerprint.
const ATTRIBUTE: &str = " blinn:stamp=\"";

/// Encodes 8-bit colours, without the alpha channel if every pixel is opaque.
pub(super) fn encode(
    (width, height): (u32, u32),
    colors: &DisplayColors,
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = WebPEncoder::new(&mut out);
    let text = fingerprint.map(with_room);
    if let Some(text) = &text {
        encoder.set_xmp_metadata(xmp(text));
    }
    let color = if colors.is_opaque() { ColorType::Rgb8 } else { ColorType::Rgba8 };
    encoder.encode(colors.bytes(), width, height, color).map_err(io::Error::other)?;
    if let Some(text) = &text {
        seal(&mut out, text);
    }
    Ok(out)
}

/// An XMP packet with the fingerprint, which has no characters that XML escapes.
fn xmp(fingerprint: &str) -> Vec<u8> {
    format!(
        "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"><rdf:RDF \
         xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\"><rdf:Description rdf:about=\"\" \
         xmlns:blinn=\"urn:blinn\"{ATTRIBUTE}{fingerprint}\"/></rdf:RDF></x:xmpmeta>"
    )
    .into_bytes()
}

/// The fingerprint in the XMP packet.
pub(super) fn fingerprint(file: &[u8]) -> Option<Vec<u8>> {
    let (_, packet) = riff::chunks(file).find(|(name, _)| *name == b"XMP ")?;
    let (_, value) = std::str::from_utf8(packet).ok()?.split_once(ATTRIBUTE)?;
    Some(value.split_once('"')?.0.into())
}
