//! Equirectangular pictures of light: Radiance HDR and OpenEXR.

use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, ImageReader};

use crate::geometry::Rgb;
use crate::import::Limits;
use crate::import::error::LoadError;
use crate::import::files::read_file::read_scene_file;
use crate::import::memory::MemoryBudget;
use crate::scene::SkyIrradiance;

/// No picture of light is larger: 16384 × 8192.
const MAX_PIXELS: u64 = 1 << 27;
/// Bytes of a pixel while it is decoded: as four floats, in the decoder and out of it.
const PIXEL: u64 = 32;

/// Reads the light around a scene from a .hdr or .exr file, twice as wide as high; judged by its
/// bytes. Nothing of it is kept but nine colours, so limits count it apart from scenes.
///
/// # Errors
/// A file that cannot be read, is neither, is damaged, too large, or of another shape.
pub fn load_sky(path: &Path, limits: &Limits) -> Result<SkyIrradiance, LoadError> {
    let budget = MemoryBudget::new(limits.memory_bytes);
    let bytes = read_scene_file(path, limits.file_bytes.min(limits.memory_bytes))?;
    budget.charge(bytes.len() as u64)?;
    let place = path.display();
    let wrong =
        |e: image::ImageError| LoadError::parse(&place, format!("the picture cannot be decoded: {e}"));
    let reader = || {
        let reader = ImageReader::new(Cursor::new(&bytes)).with_guessed_format();
        let reader = reader.map_err(|cause| LoadError::io(path, cause))?;
        match reader.format() {
            Some(ImageFormat::Hdr | ImageFormat::OpenExr) => Ok(reader),
            _ => Err(LoadError::Unsupported(format!(
                "{place}: neither Radiance HDR nor OpenEXR by its bytes; save the picture as .hdr or .exr"
            ))),
        }
    };
    let (width, height) = reader()?.into_dimensions().map_err(wrong)?;
    let pixels = u64::from(width) * u64::from(height);
    LoadError::check_limit("pixels of the picture of light", pixels, MAX_PIXELS.min(limits.image_pixels))?;
    if height == 0 || u64::from(width) != 2 * u64::from(height) {
        let rule = format!("an equirectangular picture is twice as wide as high, not {width}x{height}");
        return Err(LoadError::invalid(&place, rule));
    }
    budget.charge(pixels * PIXEL)?;
    let mut reader = reader()?;
    let mut decoder_limits = image::Limits::default();
    decoder_limits.max_alloc = Some((pixels * PIXEL).max(64 << 20));
    reader.limits(decoder_limits);
    let picture = reader.decode().map_err(wrong)?.into_rgb32f();
    Ok(SkyIrradiance::from_equirectangular(width, height, |x, y| Rgb::from(picture.get_pixel(x, y).0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture that is blue above and red below.
    fn picture(width: u32, height: u32) -> image::DynamicImage {
        let pixel = |_, y| image::Rgb(if y < height / 2 { [0.0, 0.0, 2.0f32] } else { [0.5, 0.0, 0.0] });
        image::ImageBuffer::from_fn(width, height, pixel).into()
    }

    fn file(folder: &Path, name: &str, width: u32, height: u32) -> std::path::PathBuf {
        let path = folder.join(name);
        picture(width, height).save(&path).unwrap();
        path
    }

    #[test]
    fn both_formats_are_read_whatever_they_are_called() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["a.hdr", "b.exr"] {
            let made = file(dir.path(), name, 32, 16);
            let path = dir.path().join("light.png");
            std::fs::copy(made, &path).unwrap();
            let sky = load_sky(&path, &Limits::default()).unwrap();
            let (up, down) = (sky.ambient(glam::DVec3::Y), sky.ambient(glam::DVec3::NEG_Y));
            assert!(up.z > 1.8 && up.x < 0.05 && down.x > 0.45 && down.z < 0.2, "{name}: {up} {down}");
        }
    }

    #[test]
    fn what_is_no_picture_of_light_is_refused_in_words() {
        let dir = tempfile::tempdir().unwrap();
        let says = |path: &Path, limits: &Limits, what: &str| {
            let error = load_sky(path, limits).unwrap_err().to_string();
            assert!(error.contains(what) && !error.contains('\n'), "{error}");
        };
        let limits = Limits::default();
        says(&dir.path().join("missing.hdr"), &limits, "missing.hdr");
        says(&file(dir.path(), "square.exr", 16, 16), &limits, "twice as wide as high, not 16x16");
        let good = file(dir.path(), "good.hdr", 32, 16);
        says(&good, &Limits { image_pixels: 100, ..Limits::default() }, "512 exceeds the limit of 100");
        // Twice its height is no u32.
        let flat = dir.path().join("flat.hdr");
        std::fs::write(&flat, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2147483648 +X 0\n").unwrap();
        says(&flat, &limits, "twice as wide as high, not 0x2147483648");
        let text = dir.path().join("text.hdr");
        std::fs::write(&text, "hello").unwrap();
        says(&text, &limits, "neither Radiance HDR nor OpenEXR");
        // Cut off and garbled files are errors or pictures, never a crash.
        for name in ["good.hdr", "b.exr"] {
            let whole = std::fs::read(file(dir.path(), name, 32, 16)).unwrap();
            let cut = dir.path().join("cut");
            for at in (0..whole.len()).step_by(1 + whole.len() / 60) {
                std::fs::write(&cut, &whole[..at]).unwrap();
                assert!(load_sky(&cut, &limits).is_err(), "{name} cut at {at} of {}", whole.len());
                let mut garbled = whole.clone();
                garbled[at] ^= 0x55;
                std::fs::write(&cut, garbled).unwrap();
                let _ = load_sky(&cut, &limits);
            }
        }
    }
}
