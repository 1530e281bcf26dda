//! Looks for the files of BOP of a finished scene that stand beside its images or archive.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use serde::de::{DeserializeOwned, IgnoredAny};

use crate::plan::{DatasetFolders, RenderPlan};
use blinn_session::PlannedFrame;

/// Returns true if the images of `frames` have all files of BOP. Those whose names depend on the number of objects are found
/// through a file that describes these.
pub fn has_bop_files(plan: &RenderPlan, scene: &Path, index: usize, frames: &[PlannedFrame]) -> bool {
    let folders = plan.dataset_folders(scene, index);
    match plan.outputs.shards.is_some() {
        true => has_models(&folders),
        false => has_images(&folders, frames),
    }
}

/// Returns true if the images of `frames` have a depth image and a mask of each of their objects.
fn has_images(folders: &DatasetFolders, frames: &[PlannedFrame]) -> bool {
    let Some(objects) = read::<BTreeMap<i64, Vec<IgnoredAny>>>(&folders.bop_scene.join("scene_gt.json"))
    else {
        return false;
    };
    let exists = |folder: &str, name: String| folders.bop_scene.join(folder).join(name).is_file();
    frames.iter().all(|PlannedFrame { number, .. }| {
        let count = objects.get(number).map_or(0, Vec::len);
        let has_masks = |folder: &str| (0..count).all(|k| exists(folder, format!("{number:06}_{k:06}.png")));
        exists("depth", format!("{number:06}.png")) && has_masks("mask") && has_masks("mask_visib")
    })
}

/// Returns true if the models of a scene in an archive exist.
fn has_models(folders: &DatasetFolders) -> bool {
    read::<BTreeMap<u32, IgnoredAny>>(&folders.models_info)
        .is_some_and(|models| models.keys().all(|object| folders.model(*object).is_file()))
}

/// A JSON file; `None` if it does not exist or has another form.
fn read<T: DeserializeOwned>(file: &Path) -> Option<T> {
    serde_json::from_reader(BufReader::new(File::open(file).ok()?)).ok()
}
