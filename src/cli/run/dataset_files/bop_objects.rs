//! The objects of a scene in datasets of BOP: their numbers, their poses in images, and their models.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use serde_json::{Map, Value};

use super::context::{DatasetFiles, ImageMasks};
use blinn_output::datasets::{
    BopImage, BopObject, Dataset, DatasetView, Pinhole, PosedObject, RigidPose, WorldUp, posed_objects,
};
use blinn_scene::PosedScene;

/// Numbers of objects that each scene has where scenes share their models: scene 2 has objects from 2001 on.
const OBJECTS_PER_SCENE: u32 = 1000;

/// The objects of a scene.
pub struct BopObjects<'a> {
    files: &'a DatasetFiles<'a>,
    posed: &'a PosedScene<'a>,
    /// Added to the numbers of objects: where scenes share their models, each has a thousand of its own.
    first_object: u32,
    objects: BTreeMap<u32, PosedObject>,
}

impl<'a> BopObjects<'a> {
    /// Numbers the objects of a scene.
    ///
    /// # Errors
    /// The scene has too many objects, or too large a number, to share its models with others.
    pub fn new(files: &'a DatasetFiles<'a>, posed: &'a PosedScene<'a>) -> Result<BopObjects<'a>> {
        let objects = posed_objects(posed);
        let plan = files.transforms.plan;
        let shares_models = plan.formats.is_merged || plan.outputs.shards.is_some();
        let last = objects.last_key_value().map_or(0, |(object, _)| *object);
        if shares_models && last >= OBJECTS_PER_SCENE {
            let (what, instead) = match plan.formats.is_merged {
                true => ("--merge: the scene", "remove --merge"),
                false => ("--dataset bop: the scene", "set -o to a folder"),
            };
            bail!(
                "{what} has {last} objects, but scenes that share their models number only {} in each; {instead}",
                OBJECTS_PER_SCENE - 1
            );
        }
        let index = if shares_models { files.transforms.index } else { 0 };
        let first_object = u32::try_from(index).ok().and_then(|index| index.checked_mul(OBJECTS_PER_SCENE));
        let first_object = first_object.context("--dataset bop: there are too many scenes")?;
        Ok(BopObjects { files, posed, first_object, objects })
    }

    /// Describes a view, in which objects have `masks`.
    pub fn image(&self, dataset: &Dataset, view: &DatasetView, masks: &[ImageMasks]) -> BopImage {
        let pinhole = Pinhole::new(&view.camera, dataset.size, dataset.window);
        let world_to_camera = RigidPose::world_to_camera(&view.camera, dataset.up);
        let object = |mask: &ImageMasks| {
            let pose = in_world(&self.objects.get(&mask.object)?.pose, dataset.up);
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
        BopImage::new(&pinhole, &world_to_camera, dataset.depth_step.unwrap_or(1.0), &objects)
    }

    /// Writes the models and then the file with their extents. Returns those that were written.
    pub fn write_models(&self) -> Result<Vec<PathBuf>> {
        let folders = self.files.folders();
        let mut written = Vec::new();
        let mut info = Map::new();
        for (object, posed) in &self.objects {
            let model = posed.model(self.posed);
            if model.triangles.is_empty() {
                continue;
            }
            let object = self.first_object.saturating_add(*object);
            info.insert(object.to_string(), model.info());
            written.extend(self.files.update_file(&folders.model(object), &model.to_ply())?);
        }
        let info = format!("{:#}\n", Value::Object(info));
        written.extend(self.files.write_file(&folders.models_info, info.as_bytes())?);
        Ok(written)
    }
}

/// The pose in the dataset's world of an object with a pose in blinn's.
fn in_world(pose: &RigidPose, up: WorldUp) -> RigidPose {
    RigidPose { rotation: up.rotation() * pose.rotation, translation: up.rotation() * pose.translation }
}
