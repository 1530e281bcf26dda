//! Sizes of images that no option gives, and the region that is rendered.

use crate::error::SessionError;
use blinn_core::worded;
use blinn_render::RenderSettings;
use blinn_scene::Scene;

/// Longer side of an image without a given size, in pixels.
const DEFAULT_SIDE: u32 = 1280;
/// Size of an image without a given size and without a file camera: 16:9.
pub(crate) const DEFAULT_SIZE: (u32, u32) = (1280, 720);

/// A size of the same aspect ratio, with `side` pixels at its longer side.
pub fn scaled_to(side: u32, (width, height): (u32, u32)) -> (u32, u32) {
    let scaled = |pixels: u32| {
        let exact = f64::from(pixels) * f64::from(side) / f64::from(width.max(height).max(1));
        exact.round().max(1.0) as u32
    };
    (scaled(width), scaled(height))
}

/// The default image size for a camera of the file, or for a framed scene.
pub fn natural_size(scene: &Scene, camera: Option<usize>) -> (u32, u32) {
    if let Some(size) = scene.settings.size.filter(|_| camera.is_some()) {
        return size;
    }
    let pixel_aspect = scene.settings.pixel_aspect.unwrap_or(1.0);
    let aspect = camera.and_then(|i| scene.cameras[i].aspect()).map(|aspect| aspect / pixel_aspect);
    let aspect = aspect.filter(|a| (0.01..=100.0).contains(a));
    match aspect {
        None => DEFAULT_SIZE,
        Some(a) => {
            let side = f64::from(DEFAULT_SIDE);
            let (w, h) = if a >= 1.0 { (side, side / a) } else { (side * a, side) };
            (w.round().max(1.0) as u32, h.round().max(1.0) as u32)
        }
    }
}

/// Checks that the region of `crop` lies inside the image.
///
/// # Errors
/// It reaches beyond it.
pub(crate) fn check_crop(settings: &RenderSettings) -> Result<(), SessionError> {
    let (width, height) = (settings.width, settings.height);
    if let Some(crop) = settings.crop
        && (u64::from(crop.x) + u64::from(crop.width) > u64::from(width)
            || u64::from(crop.y) + u64::from(crop.height) > u64::from(height))
    {
        let text = worded!("`crop` reaches beyond the image of {}x{} pixels", width, height);
        return Err(SessionError::Option(text));
    }
    Ok(())
}
