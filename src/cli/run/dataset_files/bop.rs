//! The files of BOP: cameras and poses, masks, depth, and models.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::bop_objects::BopObjects;
use super::context::{DatasetContext, DatasetFiles, ImageMasks};
use crate::plan::DatasetFolders;
use blinn_output::datasets::{BopScene, DatasetView};
use blinn_output::{LayerFolder, encode_mask};
use blinn_render::integrator::{Aov, Frame};
use blinn_render::{MaskRect, PixelMask, RenderSettings};

/// Writes the files of a scene.
pub struct BopWriter<'a> {
    files: &'a DatasetFiles<'a>,
    context: &'a DatasetContext<'a>,
    folders: DatasetFolders,
    objects: BopObjects<'a>,
    scene: BopScene,
}

impl<'a> BopWriter<'a> {
    /// Starts the files of a scene.
    ///
    /// # Errors
    /// The scene has too many objects for a merged dataset.
    pub fn new(files: &'a DatasetFiles<'a>, context: &'a DatasetContext<'a>) -> Result<BopWriter<'a>> {
        let objects = BopObjects::new(files, context.frame.posed)?;
        Ok(BopWriter { files, context, folders: files.folders(), objects, scene: BopScene::default() })
    }

    /// Adds a view. Writes its masks and depth image if it is one of this task, and returns the files that were written.
    pub fn add_view(
        &mut self,
        number: i64,
        view: &DatasetView,
        masks: &[ImageMasks],
        is_own: bool,
    ) -> Result<Vec<PathBuf>> {
        let dataset = &self.context.dataset;
        self.scene.add_image(number, self.objects.image(dataset, view, masks));
        if !is_own {
            return Ok(Vec::new());
        }
        let size = (dataset.window.width, dataset.window.height);
        let write_masks = |(k, mask): (usize, &ImageMasks)| {
            let name = format!("{number:06}_{k:06}.png");
            let write = |folder: &str, pixels: &PixelMask| {
                let bytes = encode_mask(size, &pixels.to_bytes(size.0, size.1))?;
                self.files.update_file(&self.folders.bop_scene.join(folder).join(&name), &bytes)
            };
            Ok([write("mask", &mask.amodal)?, write("mask_visib", &mask.visible)?])
        };
        let masks = self.objects.with_models(masks);
        let written = masks.into_par_iter().enumerate().map(write_masks).collect::<Result<Vec<_>>>()?;
        let depth = self.write_depth(number, view)?;
        Ok(written.into_iter().flatten().chain([depth]).flatten().collect())
    }

    /// Writes the depth image under the name that BOP's tools read.
    fn write_depth(&self, number: i64, view: &DatasetView) -> Result<Option<PathBuf>> {
        let image = self.files.transforms.file().with_file_name(&view.file);
        let depth = LayerFolder::Layers.file(&image, Aov::Depth.name());
        let bytes = fs::read(&depth).with_context(|| format!("{} cannot be read", depth.display()))?;
        let name = format!("{number:06}.png");
        self.files.update_file(&self.folders.bop_scene.join("depth").join(name), &bytes)
    }

    /// Writes the models and the files that describe all views. Returns those that were written.
    pub fn finish(self) -> Result<Vec<PathBuf>> {
        let mut written = self.objects.write_models()?;
        for (name, text) in self.scene.files() {
            written.extend(self.files.write_file(&self.folders.bop_scene.join(name), text.as_bytes())?);
        }
        Ok(written)
    }
}

/// The pixels in which amodal masks are traced: those of the image, and beyond it what the scene's bounds cover, up to
/// three times the width and height of the image as in BOP's toolkit.
pub fn canvas(frame: &Frame, settings: &RenderSettings) -> MaskRect {
    let window = MaskRect::from(settings.window());
    let (width, height) = (i64::from(window.width), i64::from(window.height));
    let low = [i64::from(window.x) - width, i64::from(window.y) - height];
    let high = [i64::from(window.x) + 2 * width, i64::from(window.y) + 2 * height];
    let bounds = frame.posed.bounds();
    let corner = |i: usize| {
        let pick = |k: usize| if i >> k & 1 == 0 { bounds.min[k] } else { bounds.max[k] };
        let film = frame.camera.project(DVec3::new(pick(0), pick(1), pick(2)))?;
        let size = DVec2::new(settings.width.into(), settings.height.into());
        Some(DVec2::new(film.x, 1.0 - film.y) * size)
    };
    let corners: Option<Vec<DVec2>> = (0..8).map(corner).collect();
    // Bounds that reach behind the eye may cover everything.
    let (first, last) = match corners {
        Some(corners) => (
            corners.iter().fold(DVec2::INFINITY, |low, p| low.min(*p)),
            corners.iter().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p)),
        ),
        None => (DVec2::NEG_INFINITY, DVec2::INFINITY),
    };
    let from = |k: usize, start: i32| (first[k].floor() as i64).clamp(low[k], i64::from(start));
    let to = |k: usize, end: i32| (last[k].ceil() as i64).clamp(i64::from(end), high[k]);
    let (x, y) = (from(0, window.x), from(1, window.y));
    let (right, bottom) = (to(0, window.right()), to(1, window.bottom()));
    MaskRect { x: x as i32, y: y as i32, width: (right - x) as u32, height: (bottom - y) as u32 }
}
