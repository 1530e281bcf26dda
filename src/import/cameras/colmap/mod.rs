//! Models of COLMAP, as text or binary: `cameras` has the lenses, `images` the poses.

mod binary;
mod camera_models;
mod image_pose;
mod model_files;
mod text;

pub(super) use model_files::ColmapModel;

use super::records::RecordFile;
use crate::error::LoadError;

/// Opens a model and checks all images.
pub(super) fn open(model: &ColmapModel, limit: u64) -> Result<RecordFile, LoadError> {
    if model.is_binary {
        let lenses = binary::load_lenses(&model.cameras, limit)?;
        binary::open_images(&model.images, lenses, limit)
    } else {
        let lenses = text::load_lenses(&model.cameras, limit)?;
        text::open_images(&model.images, lenses, limit)
    }
}
