//! Checks the cameras of a list against the other options, before anything is rendered.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, DefaultHasher};
use std::path::Path;

use twox_hash::XxHash3_128;

use super::outputs::{OutputKind, Outputs};
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_session::{CameraList, ImageKind, PlannedFrame};

/// Checks that every camera has a size that suits the other options, and that no two images of `scene` have the
/// same file. Returns the size with the most pixels.
pub fn check_cameras(
    cameras: &CameraList,
    outputs: &Outputs,
    scene: &Path,
) -> Result<(u32, u32), UsageError> {
    let mut largest = (0, 0);
    let mut first = None;
    let mut images: HashMap<u128, usize, BuildHasherDefault<DefaultHasher>> = HashMap::default();
    for index in 0..cameras.len() {
        let listed = cameras.listed(index).map_err(|e| UsageError(worded!("`cameras`: {}", e)))?;
        let error = |text: String| {
            let (file, name) = (cameras.path().display(), cameras.name(index));
            UsageError(worded!("`cameras` {}: camera {} '{}' {}", file, index + 1, name, text))
        };
        let size = cameras.size_of(&listed);
        let (size, crop) = size.ok_or_else(|| error(worded!("has no size; add `size` WxH")))?;
        if let Some(crop) = crop
            && (crop.x + crop.width > size.0 || crop.y + crop.height > size.1)
        {
            return Err(error(worded!(
                "has an image of {}x{} pixels, and `crop` reaches beyond it",
                size.0,
                size.1
            )));
        }
        match outputs.kind {
            OutputKind::Images(ImageKind { format, .. }) => {
                let known = crop.map_or(size, |crop| (crop.width, crop.height));
                format.check_size(known).map_err(|e| error(format!("is too large: {e}")))?;
                let frame = PlannedFrame { camera: Some(index), ..PlannedFrame::at(index as i64 + 1, 0.0) };
                for file in outputs.files(&outputs.target(scene, 1, &frame)) {
                    let hash = XxHash3_128::oneshot(file.as_os_str().as_encoded_bytes());
                    if let Some(other) = images.insert(hash, index) {
                        return Err(error(worded!(
                            "and camera {} would both be written to {}; use {{frame}} in `output`",
                            other + 1,
                            file.display()
                        )));
                    }
                }
            }
            OutputKind::Animation(_) if *first.get_or_insert(size) != size => {
                return Err(error(worded!("has another size than the first; an animation needs `size` WxH")));
            }
            OutputKind::Animation(_) => {}
        }
        let pixels = |(width, height): (u32, u32)| u64::from(width) * u64::from(height);
        if pixels(size) > pixels(largest) {
            largest = size;
        }
    }
    Ok(largest)
}
