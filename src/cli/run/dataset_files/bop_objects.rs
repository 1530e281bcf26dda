//! The objects of a scene in datasets of BOP: their numbers, their poses in images, and their models.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use serde_json::{Map, Value};
use twox_hash::XxHash3_128;

use super::context::{DatasetFiles, ImageMasks};
use blinn_core::worded;
use blinn_output::datasets::{
    BopImage, BopModel, BopObject, Dataset, DatasetView, Pinhole, PosedObject, RigidPose, WorldUp,
    posed_objects,
};
use blinn_scene::PosedScene;

/// Numbers of objects that each scene has where the models of scenes are in one folder: scene 2 has objects from 2001 on.
const OBJECTS_PER_SCENE: u32 = 1000;

/// The objects of a scene.
pub struct BopObjects<'a> {
    files: &'a DatasetFiles<'a>,
    posed: &'a PosedScene<'a>,
    /// Numbers in the dataset, by those in the scene.
    numbers: BTreeMap<u32, u32>,
    objects: BTreeMap<u32, PosedObject>,
}

impl<'a> BopObjects<'a> {
    /// Numbers the objects of a scene.
    ///
    /// # Errors
    /// The scene has too many objects, or too large a number, to share its models with others.
    pub fn new(files: &'a DatasetFiles<'a>, posed: &'a PosedScene<'a>) -> Result<BopObjects<'a>> {
        let objects = posed_objects(posed);
        let numbers: BTreeMap<u32, u32> = match files.transforms.plan.formats.shares_models {
            true => objects
                .par_iter()
                .map(|(object, of)| (*object, content_number(&of.shared_model(posed))))
                .collect(),
            false => {
                let first = first_object(files, objects.last_key_value().map_or(0, |(object, _)| *object))?;
                objects.keys().map(|object| (*object, first.saturating_add(*object))).collect()
            }
        };
        Ok(BopObjects { files, posed, numbers, objects })
    }

    /// The masks of objects with a model: those of points and lines alone have none.
    pub fn with_models<'m>(&self, masks: &'m [ImageMasks]) -> Vec<&'m ImageMasks> {
        masks.iter().filter(|mask| self.objects.contains_key(&mask.object)).collect()
    }

    /// Describes a view, in which objects have `masks`.
    pub fn image(&self, dataset: &Dataset, view: &DatasetView, masks: &[ImageMasks]) -> BopImage {
        let pinhole = Pinhole::new(&view.camera, dataset.size, dataset.window);
        let world_to_camera = RigidPose::world_to_camera(&view.camera, dataset.up);
        let object = |mask: &ImageMasks| {
            let pose = in_world(&self.objects.get(&mask.object)?.pose, dataset.up);
            Some(BopObject {
                object: *self.numbers.get(&mask.object)?,
                model_to_camera: world_to_camera.after(&pose),
                all_pixels: mask.all_pixels,
                valid_pixels: mask.amodal.area(),
                visible_pixels: mask.visible.area(),
                bounds: mask.all_bounds,
                visible_bounds: mask.visible.bounds(),
            })
        };
        let objects: Vec<BopObject> = masks.iter().filter_map(object).collect();
        BopImage::new(&pinhole, &world_to_camera, dataset.depth_step.unwrap_or(1.0), &objects)
    }

    /// Writes the models and then the file with their extents. Returns those that were written.
    ///
    /// # Errors
    /// A file cannot be written, or another model has the number of one.
    pub fn write_models(&self) -> Result<Vec<PathBuf>> {
        let folders = self.files.folders();
        let shares_models = self.files.transforms.plan.formats.shares_models;
        let mut written = Vec::new();
        let mut info = Map::new();
        for (object, posed) in &self.objects {
            let number = self.numbers[object];
            let key = number.to_string();
            if shares_models && info.contains_key(&key) {
                continue;
            }
            let model = if shares_models { posed.shared_model(self.posed) } else { posed.model(self.posed) };
            if model.triangles.is_empty() {
                continue;
            }
            info.insert(key, model.info());
            let (file, bytes) = (folders.model(number), model.to_ply());
            if shares_models && fs::read(&file).is_ok_and(|known| known != bytes) {
                bail!(worded!(
                    "`share-models`: {} is another model with the same number; remove it if it is not of this dataset, \
                     else omit `share-models`",
                    file.display()
                ));
            }
            written.extend(self.files.update_file(&file, &bytes)?);
        }
        let info = format!("{:#}\n", Value::Object(info));
        written.extend(self.files.write_file(&folders.models_info, info.as_bytes())?);
        Ok(written)
    }
}

/// The number before those of a scene's objects, of which the last is `last`: where scenes have a folder of models in common, each
/// has a thousand numbers of its own.
fn first_object(files: &DatasetFiles, last: u32) -> Result<u32> {
    let plan = files.transforms.plan;
    let has_common_folder = plan.formats.is_merged || plan.outputs.shards.is_some();
    if has_common_folder && last >= OBJECTS_PER_SCENE {
        let what = if plan.formats.is_merged { worded!("`merge`") } else { worded!("`dataset` bop") };
        bail!(worded!(
            "{}: the scene has {} objects, but scenes whose models are in one folder number only {} in each; \
             add `share-models`, or write each scene to a folder of its own",
            what,
            last,
            OBJECTS_PER_SCENE - 1
        ));
    }
    let index = if has_common_folder { files.transforms.index } else { 0 };
    let first = u32::try_from(index).ok().and_then(|index| index.checked_mul(OBJECTS_PER_SCENE));
    first.context(worded!("`dataset` bop: there are too many scenes; add `share-models`"))
}

/// The number of a model that scenes share: 31 bits of a hash of its file, as tools keep numbers in signed integers.
fn content_number(model: &BopModel) -> u32 {
    let hash = XxHash3_128::oneshot(&model.to_ply()) as u32;
    (hash >> 1).max(1)
}

/// The pose in the dataset's world of an object with a pose in blinn's.
fn in_world(pose: &RigidPose, up: WorldUp) -> RigidPose {
    RigidPose { rotation: up.rotation() * pose.rotation, translation: up.rotation() * pose.translation }
}
