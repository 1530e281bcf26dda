//! Equirectangular environment maps: Radiance HDR and OpenEXR.

use std::path::Path;

use super::{exr, radiance};
use crate::Limits;
use crate::error::LoadError;
use crate::files::read_file::read_scene_file;
use crate::memory::MemoryBudget;
use blinn_scene::{Environment, Panorama};

/// Largest environment map: 16384 × 8192 pixels.
const MAX_PIXELS: u64 = 1 << 27;
/// Bytes per pixel: three floats.
const PIXEL_BYTES: u64 = 12;
/// Bytes per pixel while lookups are prepared: a copy with half as many rows and columns.
const HALVED_PIXEL_BYTES: u64 = 3;
/// Bytes per pixel for the mip levels while they are made, of up to so many pixels.
const LEVEL_PIXEL_BYTES: u64 = 7;
const MAX_LEVEL_PIXELS: u64 = 1 << 23;
/// Bytes per pixel for light sources and a copy without them, of the map or its reduction to about so many pixels, beside
/// the mip levels.
const SOURCE_PIXEL_BYTES: u64 = 24;
const MAX_SOURCE_PIXELS: u64 = 1 << 21;
const KEPT_LEVEL_PIXEL_BYTES: u64 = 3;
/// Width for each texel of difference from twice the height: programs round, crop or scale one of the sides. Cross maps,
/// strips of faces and light probes are farther from 2 : 1.
const WIDTH_PER_DIFFERENCE: u64 = 12;

/// Loads an equirectangular environment map, about twice as wide as high, from a Radiance HDR or OpenEXR file. The
/// format is detected from the content. The map has a memory budget apart from the scene's.
///
/// # Errors
/// The file cannot be read, has another format, is damaged, exceeds a limit, or has another aspect ratio.
pub fn load_environment(path: &Path, limits: &Limits) -> Result<Environment, LoadError> {
    let budget = MemoryBudget::new(limits);
    let bytes = read_scene_file(path, limits.file_bytes.min(limits.memory_bytes))?;
    let size = bytes.len() as u64;
    budget.charge(size)?;
    let panorama = decode(&bytes, &budget, limits).map_err(|error| error.into_load_error(path))?;
    drop(bytes);
    let pixels = u64::from(panorama.width()) * u64::from(panorama.height());
    budget.charge(lookup_bytes(pixels).saturating_sub(size))?;
    Ok(Environment::from_panorama(panorama))
}

/// Decodes an equirectangular environment map that is part of a scene's file. The inner error is a warning.
///
/// # Errors
/// The map exceeds a limit.
pub(crate) fn decode_environment(
    bytes: &[u8],
    budget: &MemoryBudget,
    limits: &Limits,
) -> Result<Result<Environment, String>, LoadError> {
    match decode(bytes, budget, limits) {
        Ok(panorama) => {
            budget.charge(lookup_bytes(u64::from(panorama.width()) * u64::from(panorama.height())))?;
            Ok(Ok(Environment::from_panorama(panorama)))
        }
        Err(MapError::Limit(error)) => Err(error),
        Err(error) => Ok(Err(error.cause())),
    }
}

/// The cause why a map cannot be used.
enum MapError {
    Unsupported,
    Damaged(String),
    Invalid(String),
    Limit(LoadError),
}

impl MapError {
    fn into_load_error(self, path: &Path) -> LoadError {
        let place = path.display();
        match self {
            MapError::Unsupported => LoadError::Unsupported(format!("{place}: {}", self.cause())),
            MapError::Damaged(_) => LoadError::parse(&place, self.cause()),
            MapError::Invalid(message) => LoadError::invalid(&place, message),
            MapError::Limit(error) => error,
        }
    }

    fn cause(self) -> String {
        match self {
            MapError::Unsupported => {
                "not a Radiance HDR or OpenEXR file; save the environment map as .hdr or .exr".into()
            }
            MapError::Damaged(cause) => {
                // Some decoder messages contain line breaks.
                let cause = cause.split_whitespace().collect::<Vec<_>>().join(" ");
                format!("the environment map cannot be decoded: {cause}")
            }
            MapError::Invalid(message) => message,
            MapError::Limit(error) => error.to_string(),
        }
    }
}

/// Decodes a map. The size is checked before memory is allocated.
fn decode(bytes: &[u8], budget: &MemoryBudget, limits: &Limits) -> Result<Panorama, MapError> {
    let check = |[width, height]: [usize; 2]| check_size(width as u64, height as u64, budget, limits);
    let ([width, height], texels) = if radiance::is_radiance(bytes) {
        let header = radiance::Header::read(bytes).map_err(MapError::Damaged)?;
        let size = [header.width as usize, header.height as usize];
        check(size)?;
        (size, radiance::decode(bytes, &header).map_err(MapError::Damaged)?)
    } else if exr::is_exr(bytes) {
        let picture = exr::ExrPicture::open(bytes).map_err(MapError::Damaged)?;
        let size = picture.size();
        check(size)?;
        (size, picture.decode().map_err(MapError::Damaged)?)
    } else {
        return Err(MapError::Unsupported);
    };
    let panorama = Panorama::new(width as u32, height as u32, texels);
    panorama.ok_or_else(|| MapError::Invalid("the environment map is empty".into()))
}

/// Checks the size of a map and charges its memory.
fn check_size(width: u64, height: u64, budget: &MemoryBudget, limits: &Limits) -> Result<(), MapError> {
    let pixels = width.saturating_mul(height);
    let limit = MAX_PIXELS.min(limits.image_pixels);
    LoadError::check_limit("environment map pixels", pixels, limit).map_err(MapError::Limit)?;
    if height == 0 || width.abs_diff(2 * height).saturating_mul(WIDTH_PER_DIFFERENCE) > width {
        return Err(MapError::Invalid(format!(
            "an equirectangular environment map must be twice as wide as high, not {width}x{height}"
        )));
    }
    budget.charge(pixels * PIXEL_BYTES).map_err(MapError::Limit)
}

/// Peak bytes for the lookups of a map beside its pixels.
fn lookup_bytes(pixels: u64) -> u64 {
    let level_pixels = pixels.min(MAX_LEVEL_PIXELS);
    let sources = pixels.min(MAX_SOURCE_PIXELS) * SOURCE_PIXEL_BYTES + level_pixels * KEPT_LEVEL_PIXEL_BYTES;
    pixels * HALVED_PIXEL_BYTES + sources.max(level_pixels * LEVEL_PIXEL_BYTES)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map that is blue above the horizon and red below.
    fn map(width: u32, height: u32) -> image::DynamicImage {
        let pixel = |_, y| image::Rgb(if y < height / 2 { [0.0, 0.0, 2.0f32] } else { [0.5, 0.0, 0.0] });
        image::ImageBuffer::from_fn(width, height, pixel).into()
    }

    fn file(folder: &Path, name: &str, width: u32, height: u32) -> std::path::PathBuf {
        let path = folder.join(name);
        map(width, height).save(&path).unwrap();
        path
    }

    #[test]
    fn both_formats_are_detected_from_their_content() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["a.hdr", "b.exr"] {
            let made = file(dir.path(), name, 32, 16);
            let path = dir.path().join("light.png");
            std::fs::copy(made, &path).unwrap();
            let sky = load_environment(&path, &Limits::default()).unwrap().irradiance();
            let up = sky.ambient(glam::DVec3::Y);
            let down = sky.ambient(glam::DVec3::NEG_Y);
            assert!(up.z > 1.8 && up.x < 0.05 && down.x > 0.45 && down.z < 0.2, "{name}: {up} {down}");
        }
    }

    #[test]
    fn maps_of_nearly_twice_the_width_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let loads = |width: u32, height: u32| {
            load_environment(&file(dir.path(), "map.hdr", width, height), &Limits::default()).is_ok()
        };
        for (width, height) in [(2, 1), (4, 2), (64, 31), (63, 32), (15, 7), (200, 104)] {
            assert!(loads(width, height), "{width}x{height}");
        }
        for (width, height) in [(1, 1), (3, 1), (4, 3), (3, 4), (6, 1), (1, 6), (16, 9), (24, 10)] {
            assert!(!loads(width, height), "{width}x{height}");
        }
    }

    #[test]
    fn invalid_environment_maps_are_errors_that_name_the_defect() {
        let dir = tempfile::tempdir().unwrap();
        let fails = |path: &Path, limits: &Limits, expected: &str| {
            let error = load_environment(path, limits).unwrap_err().to_string();
            assert!(error.contains(expected) && !error.contains('\n'), "{error}");
        };
        let limits = Limits::default();
        fails(&dir.path().join("missing.hdr"), &limits, "missing.hdr");
        fails(&file(dir.path(), "square.exr", 16, 16), &limits, "twice as wide as high, not 16x16");
        let good = file(dir.path(), "good.hdr", 32, 16);
        fails(&good, &Limits { image_pixels: 100, ..Limits::default() }, "512 exceeds the limit of 100");
        // Twice the height overflows 32 bits.
        let flat = dir.path().join("flat.hdr");
        std::fs::write(&flat, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2147483648 +X 0\n").unwrap();
        fails(&flat, &limits, "twice as wide as high, not 0x2147483648");
        let text = dir.path().join("text.hdr");
        std::fs::write(&text, "hello").unwrap();
        fails(&text, &limits, "not a Radiance HDR or OpenEXR file");
        // Truncated and corrupt files never panic.
        for name in ["good.hdr", "b.exr"] {
            let whole = std::fs::read(file(dir.path(), name, 32, 16)).unwrap();
            let cut = dir.path().join("cut");
            for at in (0..whole.len()).step_by(1 + whole.len() / 60) {
                std::fs::write(&cut, &whole[..at]).unwrap();
                assert!(load_environment(&cut, &limits).is_err(), "{name} cut at {at} of {}", whole.len());
                let mut garbled = whole.clone();
                garbled[at] ^= 0x55;
                std::fs::write(&cut, garbled).unwrap();
                let _ = load_environment(&cut, &limits);
            }
        }
    }
}
