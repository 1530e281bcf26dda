//! The files of a COLMAP model.

use std::path::{Path, PathBuf};

/// The files of a model.
#[derive(Debug)]
pub(in crate::cameras) struct ColmapModel {
    pub cameras: PathBuf,
    /// The file with the poses.
    pub images: PathBuf,
    pub is_binary: bool,
}

impl ColmapModel {
    fn new(folder: &Path, is_binary: bool) -> ColmapModel {
        let extension = if is_binary { "bin" } else { "txt" };
        ColmapModel {
            cameras: folder.join(format!("cameras.{extension}")),
            images: folder.join(format!("images.{extension}")),
            is_binary,
        }
    }

    /// The model in a folder. Binary files take precedence, as in COLMAP.
    pub fn in_folder(folder: &Path) -> Option<ColmapModel> {
        let exists = |model: &ColmapModel| model.cameras.is_file() && model.images.is_file();
        [true, false].map(|is_binary| ColmapModel::new(folder, is_binary)).into_iter().find(exists)
    }

    /// The model that a file belongs to, by its name.
    pub fn of_file(file: &Path) -> Option<ColmapModel> {
        let is_binary = match file.file_name()?.to_str()? {
            "cameras.bin" | "images.bin" => true,
            "cameras.txt" | "images.txt" => false,
            _ => return None,
        };
        Some(ColmapModel::new(file.parent()?, is_binary))
    }
}
