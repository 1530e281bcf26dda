//! Data that the formats of a dataset share.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::files::create_parent_folder;
use crate::run::dataset::TransformsFile;
use crate::run::progress::SceneLog;
use blinn_core::cancellation::CancelToken;
use blinn_core::worded;
use blinn_output::datasets::{Dataset, DatasetView};
use blinn_output::{Overwrite, SaveError, write_atomically};
use blinn_render::integrator::Frame;
use blinn_render::{MaskRect, ObjectMask, PixelMask, RenderSettings, render_object_masks};

/// The files of a scene's dataset, apart from `transforms.json`.
pub struct DatasetFiles<'a> {
    pub transforms: &'a TransformsFile<'a>,
    pub log: &'a SceneLog<'a>,
}

/// The scene and the views that all formats describe.
pub struct DatasetContext<'a> {
    pub dataset: Dataset,
    pub views: Vec<NumberedView>,
    /// The scene as eye rays see it; the camera is that of the first view.
    pub frame: Frame<'a>,
    pub settings: RenderSettings,
    /// Ends the work on the scene.
    pub cancel: CancelToken,
}

impl<'a> DatasetContext<'a> {
    /// The scene as a view sees it.
    pub fn seen(&self, view: &DatasetView) -> Frame<'a> {
        Frame { camera: view.camera, ..self.frame.clone() }
    }

    /// Traces the objects in the pixels of `traced` and returns their masks within `window`.
    pub fn masks(&self, view: &DatasetView, traced: MaskRect, window: MaskRect) -> Result<Vec<ImageMasks>> {
        let masks = render_object_masks(&self.seen(view), &self.settings, traced, &self.cancel)?;
        Ok(masks.into_iter().map(|mask| ImageMasks::new(&mask, window)).collect())
    }
}

/// A view with its number.
pub struct NumberedView {
    pub number: i64,
    pub view: DatasetView,
}

impl DatasetFiles<'_> {
    /// Writes a file unless it exists with the same content, and returns its path if it was written: there are many masks,
    /// and most are kept by `--resume`.
    pub fn update_file(&self, file: &Path, bytes: &[u8]) -> Result<Option<PathBuf>> {
        match fs::read(file) {
            Ok(known) if known == bytes => Ok(None),
            _ => self.write_file(file, bytes),
        }
    }

    /// Writes a file and returns its path, or `None` if --no-overwrite keeps one with the same content.
    pub fn write_file(&self, file: &Path, bytes: &[u8]) -> Result<Option<PathBuf>> {
        let replace = self.transforms.plan.outputs.replace;
        if replace == Overwrite::No && fs::read(file).is_ok_and(|known| known == bytes) {
            return Ok(None);
        }
        create_parent_folder(file)?;
        match write_atomically(file, bytes, replace) {
            Ok(()) => Ok(Some(file.to_path_buf())),
            // Another task wrote the same file meanwhile.
            Err(_) if replace == Overwrite::No && fs::read(file).is_ok_and(|known| known == bytes) => {
                Ok(None)
            }
            Err(cause) => Err(SaveError { path: file.to_path_buf(), cause }).context(worded!("`dataset`")),
        }
    }
}

/// The masks of an object in an image.
pub struct ImageMasks {
    pub object: u32,
    /// Within the image.
    pub visible: PixelMask,
    pub amodal: PixelMask,
    /// All pixels that were traced, also outside the image.
    pub all_pixels: u64,
    /// Their bounds.
    pub all_bounds: Option<MaskRect>,
}

impl ImageMasks {
    /// The masks within `window`, counted from its upper left corner.
    pub fn new(mask: &ObjectMask, window: MaskRect) -> ImageMasks {
        let moved = |bounds: MaskRect| MaskRect {
            x: bounds.x.saturating_sub(window.x),
            y: bounds.y.saturating_sub(window.y),
            ..bounds
        };
        ImageMasks {
            object: mask.object,
            visible: mask.visible.cropped(window),
            amodal: mask.amodal.cropped(window),
            all_pixels: mask.amodal.area(),
            all_bounds: mask.amodal.bounds().map(moved),
        }
    }
}
