//! `turntable --merge`: the files that describe all scenes of a dataset, from those of each.
//!
//! They are written after the scenes, from what is on the disk, so that scenes of earlier runs and of other shares are in them.

use std::io;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow};

use super::common_files::{merge_models_info, read_text, warn_of_missing, write_common_file};
use super::progress::Reporter;
use crate::args::values::DatasetFormat;
use crate::files::with_slashes;
use crate::plan::{DatasetFolders, MergedFolder, NumberedScene, RenderPlan};
use blinn_output::datasets::{CocoMerge, CocoPart};

/// Writes the files of a merged dataset and returns them; none if the plan has no such dataset.
///
/// # Errors
/// A file that cannot be read or written, or that blinn did not write.
pub fn write_merged(plan: &RenderPlan, reporter: &Reporter) -> Result<Vec<PathBuf>> {
    let Some(folder) = plan.merged_folder().map_err(|error| anyhow!(error.0))? else { return Ok(Vec::new()) };
    let mut scenes = Vec::new();
    for scene in plan.numbered_scenes() {
        let NumberedScene { number, path } = scene.map_err(|error| anyhow!(error.0))?;
        let folders = plan.dataset_folders(&path, number);
        let images = folders.transforms.parent().unwrap_or(Path::new(""));
        let images = with_slashes(images.strip_prefix(&folder.root).unwrap_or(images));
        let first_image = plan.images_before(number).context("there are too many images")?;
        scenes.push(MergedScene { folders, images, first_image });
    }
    let dataset = MergedDataset { plan, reporter, folder, scenes };
    let mut written = Vec::new();
    if plan.formats.coco_masks().is_some() {
        written.extend(dataset.write_annotations()?);
    }
    if plan.formats.has(DatasetFormat::Bop) {
        written.extend(dataset.write_models_info()?);
    }
    Ok(written)
}

/// The files that [`write_merged`] writes if all scenes succeed.
///
/// # Errors
/// The folders of the scenes suit no merged dataset.
pub fn merged_files(plan: &RenderPlan) -> Result<Vec<PathBuf>> {
    let Some(folder) = plan.merged_folder().map_err(|error| anyhow!(error.0))? else { return Ok(Vec::new()) };
    let annotations = plan.formats.coco_masks().is_some().then(|| folder.annotations());
    let models_info = plan.formats.has(DatasetFormat::Bop).then(|| folder.models_info());
    Ok(annotations.into_iter().chain(models_info).collect())
}

struct MergedDataset<'a> {
    plan: &'a RenderPlan,
    reporter: &'a Reporter,
    folder: MergedFolder,
    scenes: Vec<MergedScene>,
}

struct MergedScene {
    folders: DatasetFolders,
    /// The folder of its images, relative to that of the dataset.
    images: String,
    /// Number of images of all scenes before.
    first_image: i64,
}

impl MergedScene {
    /// Its annotations, whose text is `text`.
    fn part<'t>(&'t self, text: &'t str) -> CocoPart<'t> {
        CocoPart { text, folder: &self.images, first_image: self.first_image }
    }
}

impl MergedDataset<'_> {
    /// Writes the annotations of all scenes that have some.
    fn write_annotations(&self) -> Result<Option<PathBuf>> {
        let file = self.folder.annotations();
        let scenes = self.scenes_with(&file, |folders| &folders.annotations);
        let mut merge = CocoMerge::default();
        for scene in &scenes {
            let text = read_text(&scene.folders.annotations)?;
            merge
                .add_images(scene.part(&text))
                .with_context(|| format!("{} cannot be merged", scene.folders.annotations.display()))?;
        }
        let written = write_common_file(&file, self.plan.outputs.replace, |out| {
            merge.begin(out)?;
            for scene in &scenes {
                let text = read_text(&scene.folders.annotations).map_err(io::Error::other)?;
                merge.add_annotations(scene.part(&text), out)?;
            }
            merge.finish(out)
        })?;
        for category in merge.unused_categories() {
            self.reporter.warn(&file, &format!("no image shows an object of category '{category}'"));
        }
        Ok(written)
    }

    /// Writes the extents of the models of all scenes.
    fn write_models_info(&self) -> Result<Option<PathBuf>> {
        let file = self.folder.models_info();
        let scenes = self.scenes_with(&file, |folders| &folders.models_info);
        let text = merge_models_info(scenes.iter().map(|scene| scene.folders.models_info.as_path()))?;
        write_common_file(&file, self.plan.outputs.replace, |out| out.write_all(text.as_bytes()))
    }

    /// The scenes whose part of a file exists. Says how many are missing.
    fn scenes_with(&self, file: &Path, part: impl Fn(&DatasetFolders) -> &PathBuf) -> Vec<&MergedScene> {
        let scenes: Vec<&MergedScene> =
            self.scenes.iter().filter(|scene| part(&scene.folders).exists()).collect();
        warn_of_missing(self.reporter, file, self.scenes.len() - scenes.len(), self.scenes.len());
        scenes
    }
}
