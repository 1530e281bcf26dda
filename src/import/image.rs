//! Image files to texels.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageReader};

use super::{Limits, ktx2};
use crate::scene::{Channels, Image, Texels};

/// Decodes an image, its format judged by its bytes alone.
///
/// # Errors
/// A sentence that says what is wrong with it.
pub(crate) fn decode(name: &str, bytes: &[u8], limits: &Limits) -> Result<Image, String> {
    let wrong = |e: &dyn std::fmt::Display| format!("image '{name}' cannot be decoded: {e}");
    let (width, height) = size(bytes).map_err(|e| wrong(&e))?;
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > limits.image_pixels {
        return Err(wrong(&format!(
            "{width}x{height} pixels, where 1 to {} are allowed",
            limits.image_pixels
        )));
    }
    let (channels, texels) = if ktx2::is_ktx2(bytes) {
        (Channels::Rgba, Texels::U8(ktx2::decode(bytes).map_err(|e| wrong(&e))?))
    } else {
        let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| wrong(&e))?;
        let mut decoder_limits = image::Limits::default();
        decoder_limits.max_alloc = Some((pixels * 16).max(64 << 20));
        reader.limits(decoder_limits);
        texels(reader.decode().map_err(|e| wrong(&e))?)
    };
    Ok(Image { name: name.to_string(), width, height, channels, texels })
}

/// What was decoded, as it is stored; layouts that nothing here has become RGBA.
fn texels(image: DynamicImage) -> (Channels, Texels) {
    use image::DynamicImage as D;
    match image {
        D::ImageLuma8(i) => (Channels::L, Texels::U8(i.into_raw())),
        D::ImageLumaA8(i) => (Channels::La, Texels::U8(i.into_raw())),
        D::ImageRgb8(i) => (Channels::Rgb, Texels::U8(i.into_raw())),
        D::ImageRgba8(i) => (Channels::Rgba, Texels::U8(i.into_raw())),
        D::ImageLuma16(i) => (Channels::L, Texels::U16(i.into_raw())),
        D::ImageLumaA16(i) => (Channels::La, Texels::U16(i.into_raw())),
        D::ImageRgb16(i) => (Channels::Rgb, Texels::U16(i.into_raw())),
        D::ImageRgba16(i) => (Channels::Rgba, Texels::U16(i.into_raw())),
        other => (Channels::Rgba, Texels::U8(other.into_rgba8().into_raw())),
    }
}

/// Bytes that [`decode`] makes of it, by its header; 0 where it has none that can be read.
pub(crate) fn decoded_bytes(bytes: &[u8]) -> u64 {
    if ktx2::is_ktx2(bytes) {
        return ktx2::size(bytes).map_or(0, |(w, h)| 4 * u64::from(w) * u64::from(h));
    }
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok();
    reader.and_then(|r| r.into_decoder().ok()).map_or(0, |d| d.total_bytes())
}

fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    if ktx2::is_ktx2(bytes) {
        return ktx2::size(bytes);
    }
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| e.to_string())?;
    if reader.format().is_none() {
        return Err("neither PNG, JPEG, WebP, KTX2, BMP nor TGA by its bytes".into());
    }
    reader.into_dimensions().map_err(|e| e.to_string())
}
