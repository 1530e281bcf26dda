//! Files beside archives of BOP for all scenes: the archive of each image, and the extents of all models.
//!
//! Both are made after the scenes, from the archives on the disk, so that scenes of earlier runs and of other shares are in them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;
use serde_json::json;

use super::archived_scenes::ArchivedShard;
use super::common_files::{merge_models_info, warn_of_missing, write_common_file};
use super::progress::Reporter;
use crate::plan::RenderPlan;
use blinn_output::Overwrite;

/// Writes the files that differ from those on the disk, and returns them; none for other outputs than archives of BOP.
///
/// # Errors
/// A file that cannot be read or written, or that blinn did not write.
pub fn write_archive_index(plan: &RenderPlan, reporter: &Reporter) -> Result<Vec<PathBuf>> {
    let (Some(shards), Some(folder)) = (&plan.outputs.shards, plan.archive_folder()) else {
        return Ok(Vec::new());
    };
    let count = plan.scenes.len();
    let mut shard_of_key: BTreeMap<String, usize> = BTreeMap::new();
    let mut numbers: BTreeSet<usize> = BTreeSet::new();
    for shard in 0..shards.count(count) {
        let file = shards.numbered(shard);
        let Some(archive) = ArchivedShard::open(&file)? else {
            // Archives of limited bytes follow one another.
            if shards.max_bytes().is_some() {
                break;
            }
            continue;
        };
        for scene in &archive.scenes {
            // Archives of earlier runs may have scenes of those before them, or no models.
            let has_models = || folder.scene_models_info(scene.number).is_file();
            if (1..=count).contains(&scene.number) && has_models() && numbers.insert(scene.number) {
                shard_of_key.extend(scene.keys().map(|key| (key.to_string(), shard)));
            }
        }
    }
    let lines: Vec<String> =
        shard_of_key.iter().map(|(key, shard)| format!("  {}: {shard}", json!(key))).collect();
    let key_to_shard = format!("{{\n{}\n}}\n", lines.join(",\n"));
    let parts: Vec<PathBuf> = numbers.iter().map(|number| folder.scene_models_info(*number)).collect();
    let models_info = merge_models_info(parts.iter().map(PathBuf::as_path))?;
    warn_of_missing(reporter, &folder.key_to_shard, count - numbers.len(), count);
    let replace = plan.outputs.replace;
    let mut written = Vec::new();
    written.extend(update(&folder.key_to_shard, &key_to_shard, replace)?);
    written.extend(update(&folder.models_info(), &models_info, replace)?);
    Ok(written)
}

/// Writes a file unless it has this content, and returns its path if it was written.
fn update(file: &Path, text: &str, replace: Overwrite) -> Result<Option<PathBuf>> {
    if fs::read(file).is_ok_and(|known| known == text.as_bytes()) {
        return Ok(None);
    }
    write_common_file(file, replace, |out| out.write_all(text.as_bytes()))
}
