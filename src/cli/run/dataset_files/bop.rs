//! The files of BOP: cameras and poses, masks, depth, and models.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde_json::{Map, Value};

use super::context::{DatasetContext, DatasetFiles, ImageMasks};
use crate::plan::DatasetFolders;
use blinn_output::datasets::{
    BopObject, BopScene, DatasetView, Pinhole, PosedObject, RigidPose, WorldUp, posed_objects,
};
use blinn_output::{LayerFolder, encode_mask};
use blinn_render::integrator::{Aov, Frame};
use blinn_render::{MaskRect, PixelMask, RenderSettings};

/// Numbers of objects that each scene of a merged dataset has: scene 2 has objects from 2001 on.
const OBJECTS_PER_SCENE: u32 = 1000;

/// Writes the files of a scene.
pub struct BopWriter<'a> {
    files: &'a DatasetFiles<'a>,
    context: &'a DatasetContext<'a>,
    folders: DatasetFolders,
    /// Added to the numbers of objects: each scene of a merged dataset has a thousand of its own.
    first_object: u32,
    objects: BTreeMap<u32, PosedObject>,
    scene: BopScene,
}

impl<'a> BopWriter<'a> {
    /// Starts the files of a scene.
    ///
    /// # Errors
    /// The scene has too many objects for a merged dataset.
    pub fn new(files: &'a DatasetFiles<'a>, context: &'a DatasetContext<'a>) -> Result<BopWriter<'a>> {
        let objects = posed_objects(context.frame.posed);
        let is_merged = files.transforms.plan.formats.is_merged;
        let last = objects.last_key_value().map_or(0, |(object, _)| *object);
        if is_merged && last >= OBJECTS_PER_SCENE {
            bail!(
                "--merge: the scene has {last} objects, but a merged dataset of BOP numbers only {} in each; \
                 remove --merge",
                OBJECTS_PER_SCENE - 1
            );
        }
        let index = if is_merged { files.transforms.index } else { 0 };
        let first_object = u32::try_from(index).ok().and_then(|index| index.checked_mul(OBJECTS_PER_SCENE));
        Ok(BopWriter {
            files,
            context,
            folders: files.folders(),
            first_object: first_object.context("--merge: there are too many scenes")?,
            objects,
            scene: BopScene::default(),
        })
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
        let pinhole = Pinhole::new(&view.camera, dataset.size, dataset.window);
        let world_to_camera = RigidPose::world_to_camera(&view.camera, dataset.up);
        let to_world = |pose: &RigidPose| in_world(pose, dataset.up);
        let object = |mask: &ImageMasks| {
            let pose = to_world(&self.objects.get(&mask.object)?.pose);
            Some(BopObject {
                object: self.first_object.saturating_add(mask.object),
                model_to_camera: world_to_camera.after(&pose),
                all_pixels: mask.all_pixels,
                valid_pixels: mask.amodal.area(),
                visible_pixels: mask.visible.area(),
                bounds: mask.all_bounds,
                visible_bounds: mask.visible.bounds(),
            })
        };
        let objects: Vec<BopObject> = masks.iter().filter_map(object).collect();
        let step = dataset.depth_step.unwrap_or(1.0);
        self.scene.add_image(number, &pinhole, &world_to_camera, step, &objects);
        if !is_own {
            return Ok(Vec::new());
        }
        let size = (pinhole.width, pinhole.height);
        let write_masks = |(k, mask): (usize, &ImageMasks)| {
            let name = format!("{number:06}_{k:06}.png");
            let write = |folder: &str, pixels: &PixelMask| {
                let bytes = encode_mask(size, &pixels.to_bytes(size.0, size.1))?;
                self.files.update_file(&self.folders.bop_scene.join(folder).join(&name), &bytes)
            };
            Ok([write("mask", &mask.amodal)?, write("mask_visib", &mask.visible)?])
        };
        let written = masks.par_iter().enumerate().map(write_masks).collect::<Result<Vec<_>>>()?;
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
        let mut written = Vec::new();
        let mut info = Map::new();
        for (object, posed) in &self.objects {
            let model = posed.model(self.context.frame.posed);
            if model.triangles.is_empty() {
                continue;
            }
            let object = self.first_object.saturating_add(*object);
            info.insert(object.to_string(), model.info());
            let file = self.folders.bop_models.join(format!("obj_{object:06}.ply"));
            written.extend(self.files.update_file(&file, &model.to_ply())?);
        }
        let info = format!("{:#}\n", Value::Object(info));
        written.extend(self.files.write_file(&self.folders.models_info, info.as_bytes())?);
        for (name, text) in self.scene.files() {
            written.extend(self.files.write_file(&self.folders.bop_scene.join(name), text.as_bytes())?);
        }
        Ok(written)
    }
}

/// The pose in the dataset's world of an object with a pose in blinn's.
fn in_world(pose: &RigidPose, up: WorldUp) -> RigidPose {
    RigidPose { rotation: up.rotation() * pose.rotation, translation: up.rotation() * pose.translation }
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
