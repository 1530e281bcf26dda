//! The folders of a dataset.

use std::path::{Path, PathBuf};

use super::dataset_formats::FormatsPlan;
use crate::args::values::DatasetFormat;
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_output::datasets::{ColmapForm, MODELS_INFO};

/// The annotations of COCO.
const ANNOTATIONS: &str = "annotations.json";
/// The folder of images in datasets of COLMAP.
const COLMAP_IMAGES: &str = "images";

/// Where the files of a scene's dataset are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DatasetFolders {
    /// The cameras of the scene's images.
    pub transforms: PathBuf,
    /// The annotations of the scene's images.
    pub annotations: PathBuf,
    /// The folder of COLMAP's model.
    pub colmap: PathBuf,
    /// The folder that names in COLMAP's model are relative to.
    pub colmap_images: PathBuf,
    /// BOP's `ROOT/SPLIT/SCENE`, if images are `ROOT/SPLIT/SCENE/rgb/*`.
    pub bop_scene: PathBuf,
    /// BOP's `ROOT/models`.
    pub bop_models: PathBuf,
    /// The extents of the scene's models.
    pub models_info: PathBuf,
}

impl DatasetFolders {
    /// The folders of a scene that shares none with another. `transforms` is the `transforms.json` beside its images.
    pub fn of_scene(transforms: PathBuf) -> DatasetFolders {
        let images = folder(&transforms);
        let above = if images.ends_with(COLMAP_IMAGES) { folder(&images) } else { images.clone() };
        let bop_scene = folder(&images);
        let bop_models = folder(&folder(&bop_scene)).join("models");
        DatasetFolders {
            annotations: images.join(ANNOTATIONS),
            colmap: above.join("sparse/0"),
            colmap_images: images,
            models_info: bop_models.join(MODELS_INFO),
            bop_scene,
            bop_models,
            transforms,
        }
    }

    /// The folders of the `index`-th scene, counted from 1, of a merged dataset in `merged`.
    pub fn of_merged(transforms: PathBuf, merged: &MergedFolder, index: usize) -> DatasetFolders {
        let scene = DatasetFolders::of_scene(transforms);
        DatasetFolders {
            colmap: merged.root.join(format!("sparse/{}", index.saturating_sub(1))),
            colmap_images: merged.colmap_images.clone(),
            models_info: scene.bop_scene.join(MODELS_INFO),
            ..scene
        }
    }

    /// The folders of the `index`-th scene, counted from 1, whose images go into an archive of BOP in `archives`.
    pub fn of_archive(transforms: PathBuf, archives: &ArchiveFolder, index: usize) -> DatasetFolders {
        DatasetFolders {
            models_info: archives.scene_models_info(index),
            bop_models: archives.models.clone(),
            ..DatasetFolders::of_scene(transforms)
        }
    }

    /// The files that describe all views in these formats.
    pub fn files(&self, formats: &FormatsPlan) -> Vec<PathBuf> {
        let mut files = Vec::new();
        if formats.has(DatasetFormat::Nerf) {
            files.push(self.transforms.clone());
        }
        if formats.coco_masks().is_some() {
            files.push(self.annotations.clone());
        }
        if let Some(form) = formats.colmap_form() {
            files.extend(form.names().map(|name| self.colmap.join(name)));
        }
        if formats.has(DatasetFormat::Bop) {
            let names = ["scene_camera.json", "scene_gt.json", "scene_gt_info.json"];
            files.extend(names.map(|name| self.bop_scene.join(name)));
            files.push(self.models_info.clone());
        }
        files
    }

    /// BOP's model of an object.
    pub fn model(&self, object: u32) -> PathBuf {
        self.bop_models.join(format!("obj_{object:06}.ply"))
    }

    /// A path that only scenes with a file in common share.
    pub fn shared_path(&self, formats: &FormatsPlan) -> &Path {
        if formats.is_merged {
            &self.transforms
        } else if formats.has(DatasetFormat::Bop) {
            &self.bop_models
        } else if formats.colmap_form().is_some() {
            &self.colmap
        } else {
            &self.transforms
        }
    }

    /// A file that readers of a text model of COLMAP would read instead of it.
    pub fn preferred_model(&self, formats: &FormatsPlan) -> Option<PathBuf> {
        formats.colmap_form().filter(|form| *form == ColmapForm::Text)?;
        ColmapForm::Binary.names().map(|name| self.colmap.join(name)).into_iter().find(|file| file.exists())
    }
}

/// The folder of a dataset that several scenes share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MergedFolder {
    /// The folder of the files that describe all scenes.
    pub root: PathBuf,
    /// The folder that names in COLMAP's models are relative to.
    colmap_images: PathBuf,
}

impl MergedFolder {
    /// The folder above those of the scenes, from the `transforms.json` of one of them.
    ///
    /// # Errors
    /// The scene's images have no folder of their own.
    pub fn of(transforms: &Path, formats: &FormatsPlan) -> Result<MergedFolder, UsageError> {
        let images = folder(transforms);
        if formats.has(DatasetFormat::Bop) {
            let root = folder(&folder(&folder(&images)));
            return Ok(MergedFolder { colmap_images: root.clone(), root });
        }
        let mut above = images.ancestors().skip(1);
        if formats.colmap_form().is_some() {
            let Some(colmap_images) = above.find(|folder| folder.ends_with(COLMAP_IMAGES)) else {
                return Err(UsageError(worded!(
                    "`merge`: COLMAP's images of several scenes are in FOLDER/images/SCENE/; set `output` FOLDER/, or \
                     `output` 'FOLDER/images/{{index:04}}-{{stem}}/####.png'"
                )));
            };
            return Ok(MergedFolder { root: folder(colmap_images), colmap_images: colmap_images.into() });
        }
        match above.next() {
            Some(root) => Ok(MergedFolder { root: root.into(), colmap_images: root.into() }),
            None => Err(UsageError(worded!(
                "`merge`: each scene needs a folder of its own; set `output` FOLDER/, or `output` \
                 'FOLDER/{{index:04}}-{{stem}}/####.png'"
            ))),
        }
    }

    /// The annotations of all scenes.
    pub fn annotations(&self) -> PathBuf {
        self.root.join(ANNOTATIONS)
    }

    /// The extents of the models of all scenes.
    pub fn models_info(&self) -> PathBuf {
        self.root.join("models").join(MODELS_INFO)
    }

    /// The files that describe all scenes.
    pub fn files(&self, formats: &FormatsPlan) -> Vec<PathBuf> {
        let mut files = Vec::new();
        if formats.coco_masks().is_some() {
            files.push(self.annotations());
        }
        if formats.has(DatasetFormat::Bop) {
            files.push(self.models_info());
        }
        files
    }
}

/// Files beside archives of BOP.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArchiveFolder {
    /// The archive of each image, by its number.
    pub key_to_shard: PathBuf,
    /// BOP's `ROOT/models`.
    pub models: PathBuf,
}

/// Beginnings of the names of BOP's splits: `ROOT/train_pbr` and the like.
const BOP_SPLITS: [&str; 3] = ["train", "val", "test"];

impl ArchiveFolder {
    /// Returns the files beside the archives in `archives`. The models of a folder that is named as a split of BOP are in the folder
    /// above.
    pub fn of(archives: &Path) -> ArchiveFolder {
        let name = archives.file_name().unwrap_or_default().to_string_lossy();
        let is_split = BOP_SPLITS.iter().any(|split| {
            name.strip_prefix(*split).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
        });
        let root = if is_split { folder(archives) } else { archives.to_path_buf() };
        ArchiveFolder { key_to_shard: archives.join("key_to_shard.json"), models: root.join("models") }
    }

    /// The extents of the models of the `index`-th scene, counted from 1.
    pub fn scene_models_info(&self, index: usize) -> PathBuf {
        self.models.join(format!("scenes/{index:06}.json"))
    }

    /// The extents of the models of all scenes.
    pub fn models_info(&self) -> PathBuf {
        self.models.join(MODELS_INFO)
    }

    /// The files that describe all archives.
    pub fn files(&self) -> [PathBuf; 2] {
        [self.key_to_shard.clone(), self.models_info()]
    }
}

fn folder(path: &Path) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).to_path_buf()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_follow_from_that_of_the_images() {
        let of = |transforms: &str| DatasetFolders::of_scene(transforms.into());
        assert_eq!(of("a/images/transforms.json").colmap, Path::new("a/sparse/0"));
        assert_eq!(of("images/transforms.json").colmap, Path::new("sparse/0"));
        assert_eq!(of("a/transforms.json").colmap, Path::new("a/sparse/0"));
        assert_eq!(of("transforms.json").colmap, Path::new("sparse/0"));
        let tower = of("tower/train/000001/rgb/transforms.json");
        assert_eq!((tower.bop_scene, tower.bop_models), ("tower/train/000001".into(), "tower/models".into()));
        assert_eq!(of("train/000001/rgb/transforms.json").bop_models, Path::new("models"));
    }

    #[test]
    fn archives_of_a_split_have_their_models_above() {
        for (folder, models) in [
            ("data/train_web", "data/models"),
            ("test", "models"),
            ("data/training", "data/training/models"),
            ("", "models"),
        ] {
            let archives = ArchiveFolder::of(Path::new(folder));
            let scene = DatasetFolders::of_archive("transforms.json".into(), &archives, 12);
            assert_eq!(archives.key_to_shard, Path::new(folder).join("key_to_shard.json"));
            assert_eq!(scene.bop_models, Path::new(models), "{folder}");
            assert_eq!(scene.models_info, Path::new(models).join("scenes/000012.json"));
        }
    }
}
