//! Writes `transforms.json`: the cameras of a dataset's images.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::plan::{RenderPlan, Target};
use blinn_output::datasets::{Dataset, DatasetView};
use blinn_output::{Overwrite, SaveError, check_overwrite, write_atomically};
use blinn_render::integrator::Aov;
use blinn_scene::Scene;
use blinn_session::{DatasetViews, ImageCamera};

/// Keys under which NeRF tools look for an AOV.
const AOV_KEYS: [(Aov, &[&str]); 3] = [
    (Aov::Depth, &["depth_path", "depth_file_path"]),
    (Aov::Normal, &["normal_file_path"]),
    (Aov::Mask, &["mask_path"]),
];

/// The `transforms.json` of one scene.
pub struct TransformsFile<'a> {
    pub plan: &'a RenderPlan,
    pub views: &'a DatasetViews<'a>,
    pub scene: &'a Scene,
    /// The scene's file.
    pub path: &'a Path,
    /// The scene's number, from 1.
    pub index: usize,
}

impl TransformsFile<'_> {
    /// Writes the file and returns its path, or `None` if it exists already and --no-overwrite keeps it.
    ///
    /// It describes all views, also those that --only or --chunk leave out: all tasks of a farm write the same file,
    /// except for the marks of empty images. Images that were not rendered keep the marks of an existing file.
    /// `views_shown` says which images show something.
    pub fn write(&self, views_shown: &BTreeMap<String, bool>) -> Result<Option<PathBuf>> {
        let file = self.file();
        let replace = self.plan.outputs.replace;
        let (dataset, mut views) = self.describe()?;
        let marked = self.marks_of_same(&file, &dataset, &views).unwrap_or_default();
        for view in &mut views {
            let is_shown = views_shown.get(&view.file);
            view.is_empty = is_shown.map_or_else(|| marked.contains(&view.file), |is_shown| !is_shown);
        }
        match write_atomically(&file, dataset.to_json(&self.scene_name(), &views).as_bytes(), replace) {
            Ok(()) => Ok(Some(file)),
            // Another task wrote the same file, or writes it now.
            Err(_) if replace == Overwrite::No && self.marks_of_same(&file, &dataset, &views).is_some() => {
                Ok(None)
            }
            Err(cause) => Err(SaveError { path: file, cause }.into()),
        }
    }

    /// Returns an error if --no-overwrite keeps a file with other content.
    pub fn check(&self) -> Result<()> {
        let file = self.file();
        let Err(error) = check_overwrite(&file, self.plan.outputs.replace) else { return Ok(()) };
        if file.is_file() {
            let (dataset, views) = self.describe()?;
            if self.marks_of_same(&file, &dataset, &views).is_some() {
                return Ok(());
            }
        }
        Err(error.into())
    }

    pub fn file(&self) -> PathBuf {
        self.plan.outputs.transforms_file(self.path, self.index)
    }

    /// The content of the file, without marks of empty images.
    pub fn describe(&self) -> Result<(Dataset, Vec<DatasetView>)> {
        Ok((self.views.describe(), self.describe_views()?))
    }

    /// File names and cameras of all views.
    fn describe_views(&self) -> Result<Vec<DatasetView>> {
        let TransformsFile { plan, path, index, .. } = *self;
        let name = |file: &Path| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let layers = plan.outputs.layer_folder;
        let mut views = Vec::new();
        for frame in self.views.frames() {
            let target = plan.outputs.target(path, index, &frame);
            let Target::File(image) = &target else { continue };
            let files = plan.outputs.files(&target);
            let preview = |aov: Aov| {
                let expected = layers.file(image, aov.name());
                files.iter().find(|file| **file == expected).map(|file| layers.relative(&name(file)))
            };
            let previews = AOV_KEYS.iter().filter_map(|&(aov, keys)| Some((keys, preview(aov)?)));
            let keys_and_files =
                previews.flat_map(|(keys, file)| keys.iter().map(move |&key| (key, file.clone())));
            let ImageCamera { camera, light, .. } = self.views.view(&frame)?;
            views.push(DatasetView {
                file: name(image),
                layers: keys_and_files.collect(),
                camera,
                light,
                is_empty: false,
            });
        }
        Ok(views)
    }

    /// The name of the scene's file, without its folder: the same from anywhere.
    fn scene_name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// The images that an existing file marks as empty, if the rest of its content is the same.
    fn marks_of_same(
        &self,
        file: &Path,
        dataset: &Dataset,
        views: &[DatasetView],
    ) -> Option<BTreeSet<String>> {
        let text = std::fs::read_to_string(file).ok()?;
        let marked = Dataset::empty_images(&text);
        let with_mark =
            |view: &DatasetView| DatasetView { is_empty: marked.contains(&view.file), ..view.clone() };
        let views: Vec<DatasetView> = views.iter().map(with_mark).collect();
        (dataset.to_json(&self.scene_name(), &views) == text).then_some(marked)
    }
}

/// Notes for `transforms.json` if an image shows something.
pub fn note_view(views_shown: &mut BTreeMap<String, bool>, file: &Path, is_shown: bool) {
    let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    views_shown.insert(name, is_shown);
}
