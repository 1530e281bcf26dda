//! Looks for BOP's masks and depth images of a finished scene, whose number only its `scene_gt.json` has.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;

use serde::de::IgnoredAny;

use crate::plan::DatasetFolders;
use blinn_session::PlannedFrame;

/// Returns true if the images of `frames` have a depth image and a mask of each of their objects.
pub fn has_bop_images(folders: &DatasetFolders, frames: &[PlannedFrame]) -> bool {
    let Ok(file) = File::open(folders.bop_scene.join("scene_gt.json")) else { return false };
    let Ok(objects) = serde_json::from_reader::<_, BTreeMap<i64, Vec<IgnoredAny>>>(BufReader::new(file))
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
