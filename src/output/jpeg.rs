//! JPEG: 8 bits, opaque, sRGB, chroma at full resolution.

use std::io;

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};

use super::checksum::{seal, with_room};
use super::display_colors::DisplayColors;
use super::picture::FINGERPRINT_KEY;

/// The marker of a comment segment.
const COMMENT: [u8; 2] = [0xff, 0xfe];
/// Length of the start-of-image marker.
const START_OF_IMAGE: usize = 2;

/// Encodes opaque colours with a quality from 1 to 100.
pub(super) fn encode(
    (width, height): (u32, u32),
    colors: &DisplayColors,
    quality: u8,
    fingerprint: Option<&str>,
) -> io::Result<Vec<u8>> {
    if !colors.is_opaque() {
        let message = "JPEG has no transparency; set a background, or write PNG or WebP";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    let mut out = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut out, quality.clamp(1, 100));
    encoder.write_image(colors.bytes(), width, height, ExtendedColorType::Rgb8).map_err(io::Error::other)?;
    if let Some(fingerprint) = fingerprint {
        let text = with_room(fingerprint);
        insert_comment(&mut out, &format!("{FINGERPRINT_KEY} {text}"));
        seal(&mut out, &text);
    }
    Ok(out)
}

/// Inserts a comment after the start-of-image marker. A text too long for a comment is left out.
fn insert_comment(file: &mut Vec<u8>, text: &str) {
    // The length counts itself.
    if let Ok(length) = u16::try_from(text.len() + 2) {
        let segment = [&COMMENT, &length.to_be_bytes()[..], text.as_bytes()].concat();
        file.splice(START_OF_IMAGE..START_OF_IMAGE, segment);
    }
}

/// The fingerprint in the comment after the start-of-image marker.
pub(super) fn fingerprint(file: &[u8]) -> Option<Vec<u8>> {
    let (length, after) = file.get(START_OF_IMAGE..)?.strip_prefix(&COMMENT)?.split_first_chunk::<2>()?;
    let text = after.get(..usize::from(u16::from_be_bytes(*length)).checked_sub(2)?)?;
    text.strip_prefix(FINGERPRINT_KEY.as_bytes())?.strip_prefix(b" ").map(<[u8]>::to_vec)
}
