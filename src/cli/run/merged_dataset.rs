//! `turntable --merge`: the files that describe all scenes of a dataset, from those of each.
//!
//! They are written after the scenes, from what is on the disk, so that scenes of earlier runs and of other shares are in them.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use serde_json::{Map, Value};

use super::progress::Reporter;
use crate::args::values::DatasetFormat;
use crate::files::{create_parent_folder, with_slashes};
use crate::plan::{DatasetFolders, MergedFolder, NumberedScene, RenderPlan};
use blinn_output::datasets::{CocoMerge, CocoPart};
use blinn_output::{Overwrite, SaveError, write_atomically_with};

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
            let text = read(&scene.folders.annotations)?;
            merge
                .add_images(scene.part(&text))
                .with_context(|| format!("{} cannot be merged", scene.folders.annotations.display()))?;
        }
        let written = self.write(&file, |out| {
            merge.begin(out)?;
            for scene in &scenes {
                let text = read(&scene.folders.annotations).map_err(io::Error::other)?;
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
        let mut models: Vec<(u64, Value)> = Vec::new();
        for scene in self.scenes_with(&file, |folders| &folders.models_info) {
            let path = &scene.folders.models_info;
            let info: Map<String, Value> = serde_json::from_str(&read(path)?)
                .with_context(|| format!("{} cannot be merged", path.display()))?;
            for (object, value) in info {
                let number = object.parse();
                models.push((number.with_context(|| format!("{}: \"{object}\"", path.display()))?, value));
            }
        }
        models.sort_by_key(|(number, _)| *number);
        let lines: Vec<String> =
            models.iter().map(|(number, info)| format!("  \"{number}\": {info}")).collect();
        self.write(&file, |out| write!(out, "{{\n{}\n}}\n", lines.join(",\n")))
    }

    /// The scenes whose part of a file exists. Says how many are missing.
    fn scenes_with(&self, file: &Path, part: impl Fn(&DatasetFolders) -> &PathBuf) -> Vec<&MergedScene> {
        let scenes: Vec<&MergedScene> =
            self.scenes.iter().filter(|scene| part(&scene.folders).exists()).collect();
        let missing = self.scenes.len() - scenes.len();
        if missing > 0 {
            let text = format!(
                "{missing} of {} scenes are missing: they failed, or other shares have not rendered them; --resume adds them",
                self.scenes.len()
            );
            self.reporter.warn(file, &text);
        }
        scenes
    }

    /// Writes a file, unless --no-overwrite keeps one with the same content.
    fn write(
        &self,
        file: &Path,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<Option<PathBuf>> {
        let replace = self.plan.outputs.replace;
        if replace == Overwrite::No && file.exists() {
            let mut bytes = Vec::new();
            write(&mut bytes).with_context(|| format!("{} cannot be merged", file.display()))?;
            if fs::read(file).is_ok_and(|known| known == bytes) {
                return Ok(None);
            }
            bail!("{} exists, and --no-overwrite keeps it; run again with --resume instead", file.display());
        }
        create_parent_folder(file)?;
        let written = write_atomically_with(file, replace, |target| {
            let mut out = BufWriter::new(target);
            write(&mut out)?;
            out.flush()
        });
        written.map_err(|cause| SaveError { path: file.to_path_buf(), cause })?;
        Ok(Some(file.to_path_buf()))
    }
}

fn read(file: &Path) -> Result<String> {
    fs::read_to_string(file).with_context(|| format!("{} cannot be read", file.display()))
}
