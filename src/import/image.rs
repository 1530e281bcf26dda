//! Image files to texels.

use std::io::Cursor;

use image::{DynamicImage, ImageReader};

use super::Limits;
use crate::scene::{Image, Pixels};

/// Decodes an image, its format judged by its bytes alone.
///
/// # Errors
/// A sentence that says what is wrong with it.
pub(crate) fn decode(name: &str, bytes: &[u8], limits: &Limits) -> Result<Image, String> {
    let wrong = |e: &dyn std::fmt::Display| format!("image '{name}' cannot be decoded: {e}");
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| wrong(&e))?;
    if reader.format().is_none() {
        return Err(wrong(&"neither PNG, JPEG, WebP, BMP nor TGA by its bytes"));
    }
    let (width, height) = {
        let sizes = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| wrong(&e))?;
        sizes.into_dimensions().map_err(|e| wrong(&e))?
    };
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > limits.image_pixels {
        return Err(wrong(&format!(
            "{width}x{height} pixels, where 1 to {} are allowed",
            limits.image_pixels
        )));
    }
    let mut reader = reader;
    let mut decoder_limits = image::Limits::default();
    decoder_limits.max_alloc = Some((pixels * 16).max(64 << 20));
    reader.limits(decoder_limits);
    let decoded = reader.decode().map_err(|e| wrong(&e))?;
    Ok(Image { name: name.to_string(), width, height, pixels: texels(decoded) })
}

fn texels(image: DynamicImage) -> Pixels {
    use image::DynamicImage as D;
    match image {
        D::ImageLuma16(_) | D::ImageLumaA16(_) | D::ImageRgb16(_) | D::ImageRgba16(_) => {
            Pixels::Rgba16(image.into_rgba16().pixels().map(|p| p.0).collect())
        }
        _ => Pixels::Rgba8(image.into_rgba8().pixels().map(|p| p.0).collect()),
    }
}

/// Width and height by the file's header, where it has one that can be read.
pub(crate) fn dimensions(bytes: &[u8]) -> Option<(u32, u32)> {
    ImageReader::new(Cursor::new(bytes)).with_guessed_format().ok()?.into_dimensions().ok()
}
