//! `--dataset`: the formats of a dataset, and where their files are.

use std::path::{Path, PathBuf};

use super::outputs::{OutputKind, Outputs, Target};
use crate::args::TurnArgs;
use crate::args::values::{CategoryRule, DatasetFormat, DatasetFormats};
use crate::usage::UsageError;
use blinn_output::LayerFolder;
use blinn_output::datasets::{CocoMasks, ColmapForm};
use blinn_session::{DatasetPlan, ImageKind, PlannedFrame};

/// The formats of a dataset.
#[derive(Clone, Debug, Default)]
pub struct FormatsPlan {
    formats: DatasetFormats,
    /// The first rule that applies to an object decides its category. Never empty.
    pub categories: Vec<CategoryRule>,
}

/// The annotations of COCO.
const ANNOTATIONS: &str = "annotations.json";
/// The folder of images in datasets of COLMAP and BOP.
const COLMAP_IMAGES: &str = "images";
const BOP_IMAGES: &str = "rgb";

impl FormatsPlan {
    pub fn from_args(args: &TurnArgs) -> Result<FormatsPlan, UsageError> {
        let formats = args.dataset.clone().unwrap_or_default();
        let has_categories = !args.category.is_empty();
        let categories = if has_categories { args.category.clone() } else { vec![CategoryRule::Object] };
        let plan = FormatsPlan { formats, categories };
        if has_categories && plan.coco_masks().is_none() {
            return Err(UsageError("--category applies only to --dataset coco; add it".into()));
        }
        Ok(plan)
    }

    pub fn has(&self, format: DatasetFormat) -> bool {
        self.formats.0.contains(&format)
    }

    /// The name of images in a folder, where the formats or several scenes need folders of their own. With BOP, whose folders
    /// are fixed, the other formats are beside its images.
    pub fn image_name(&self, is_batch: bool) -> Option<&'static str> {
        match (self.has(DatasetFormat::Bop), self.colmap_form().is_some(), is_batch) {
            (true, _, false) => Some("train/000001/rgb/######.png"),
            // Each scene has models of its own.
            (true, _, true) => Some("{stem}/train/000001/rgb/######.png"),
            (false, true, false) => Some("images/####.png"),
            (false, true, true) => Some("{stem}/images/####.png"),
            (false, false, true) => Some("{stem}/####.png"),
            (false, false, false) => None,
        }
    }

    /// Where layers are: BOP's tools take every file in the folder of images as an image.
    pub fn layer_folder(&self) -> LayerFolder {
        if self.has(DatasetFormat::Bop) { LayerFolder::Layers } else { LayerFolder::Beside }
    }

    /// The form of COLMAP's model, if the dataset has one.
    pub fn colmap_form(&self) -> Option<ColmapForm> {
        match () {
            () if self.has(DatasetFormat::Colmap) => Some(ColmapForm::Text),
            () if self.has(DatasetFormat::ColmapBinary) => Some(ColmapForm::Binary),
            () => None,
        }
    }

    /// The form of masks in COCO's annotations, if the dataset has them.
    pub fn coco_masks(&self) -> Option<CocoMasks> {
        match () {
            () if self.has(DatasetFormat::Coco) => Some(CocoMasks::RunLengths),
            () if self.has(DatasetFormat::CocoPolygons) => Some(CocoMasks::Polygons),
            () => None,
        }
    }

    /// A file that readers of COLMAP's model would read instead of it. `transforms` is the `transforms.json` of the scene.
    pub fn preferred_model(&self, transforms: &Path) -> Option<PathBuf> {
        self.colmap_form().filter(|form| *form == ColmapForm::Text)?;
        let folder = colmap_folder(transforms);
        ColmapForm::Binary.names().map(|name| folder.join(name)).into_iter().find(|file| file.exists())
    }

    /// The files that describe all views of a scene. Masks and models are not among them, as their number depends on the
    /// scene. `transforms` is the `transforms.json` of the scene.
    pub fn shared_files(&self, transforms: &Path) -> Vec<PathBuf> {
        let mut files = Vec::new();
        if self.has(DatasetFormat::Nerf) {
            files.push(transforms.to_path_buf());
        }
        if self.coco_masks().is_some() {
            files.push(coco_file(transforms));
        }
        if let Some(form) = self.colmap_form() {
            let folder = colmap_folder(transforms);
            files.extend(form.names().map(|name| folder.join(name)));
        }
        if self.has(DatasetFormat::Bop) {
            let folders = BopFolders::of(transforms);
            let names = ["scene_camera.json", "scene_gt.json", "scene_gt_info.json"];
            files.extend(names.map(|name| folders.scene.join(name)));
            files.push(folders.models.join("models_info.json"));
        }
        files
    }

    /// Checks that the formats support the names and folders of images.
    pub fn check_names(
        &self,
        dataset: &DatasetPlan,
        scene: &Path,
        index: usize,
        outputs: &Outputs,
    ) -> Result<(), UsageError> {
        for number in [1, i64::from(dataset.count)] {
            let Target::File(image) = outputs.target(scene, index, &PlannedFrame::at(number, dataset.time))
            else {
                continue;
            };
            if self.colmap_form().is_some() {
                check_colmap_name(&image)?;
            }
            if self.has(DatasetFormat::Bop) {
                check_bop_name(&image, number, outputs)?;
            }
        }
        Ok(())
    }

    /// Returns an error if the formats do not suit what is written: archives and normalized scenes have transforms only.
    pub fn check_outputs(&self, outputs: &Outputs, is_normalized: bool) -> Result<(), UsageError> {
        let has_others = self.formats.0.iter().any(|format| *format != DatasetFormat::Nerf);
        let text = match () {
            () if !has_others => return Ok(()),
            () if outputs.shards.is_some() => "an archive holds images and their cameras; use --dataset nerf",
            () if is_normalized => {
                "only nerf has normalized coordinates; remove --normalize or the other formats"
            }
            () => return Ok(()),
        };
        Err(UsageError(format!("--dataset: {text}")))
    }

    /// A path that only scenes with a file in common share. `transforms` is the `transforms.json` of the scene.
    pub fn shared_path(&self, transforms: &Path) -> PathBuf {
        if self.has(DatasetFormat::Bop) {
            BopFolders::of(transforms).models
        } else if self.colmap_form().is_some() {
            colmap_folder(transforms)
        } else {
            transforms.to_path_buf()
        }
    }
}

/// The annotations beside the images.
pub fn coco_file(transforms: &Path) -> PathBuf {
    transforms.with_file_name(ANNOTATIONS)
}

/// The folder of COLMAP's model: `sparse/0`, beside a folder `images`, else beside the images.
pub fn colmap_folder(transforms: &Path) -> PathBuf {
    let images = transforms.parent().unwrap_or(Path::new(""));
    let folder = if images.ends_with(COLMAP_IMAGES) { images.parent().unwrap_or(images) } else { images };
    folder.join("sparse/0")
}

/// The folders of a dataset for BOP whose images are `ROOT/SPLIT/SCENE/rgb/*`.
pub struct BopFolders {
    /// `ROOT/SPLIT/SCENE`.
    pub scene: PathBuf,
    /// `ROOT/models`.
    pub models: PathBuf,
}

impl BopFolders {
    pub fn of(transforms: &Path) -> BopFolders {
        let up = |path: &Path| path.parent().unwrap_or(Path::new("")).to_path_buf();
        let scene = up(&up(transforms));
        let models = up(&up(&scene)).join("models");
        BopFolders { scene, models }
    }
}

fn check_colmap_name(image: &Path) -> Result<(), UsageError> {
    let name = image.file_name().unwrap_or_default().to_string_lossy();
    if name.contains(char::is_whitespace) {
        let text = format!(
            "--dataset colmap: COLMAP reads no spaces in names of images, such as {name}; set another name with -o"
        );
        return Err(UsageError(text));
    }
    Ok(())
}

fn check_bop_name(image: &Path, number: i64, outputs: &Outputs) -> Result<(), UsageError> {
    let name = image.file_stem().unwrap_or_default();
    let is_image =
        matches!(outputs.kind, OutputKind::Images(ImageKind { format, .. }) if !format.supports_layers());
    let folders: Vec<_> = image.parent().into_iter().flat_map(Path::ancestors).collect();
    let is_deep = folders.len() > 3 && folders[0].ends_with(BOP_IMAGES);
    if is_image && is_deep && name == format!("{number:06}").as_str() {
        return Ok(());
    }
    Err(UsageError(
        "--dataset bop: BOP's tools read images named ROOT/SPLIT/SCENE/rgb/000001.png; set -o ROOT/ or \
         -o ROOT/train/000001/rgb/######.png"
            .into(),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_follow_from_that_of_the_images() {
        assert_eq!(colmap_folder(Path::new("a/images/transforms.json")), Path::new("a/sparse/0"));
        assert_eq!(colmap_folder(Path::new("images/transforms.json")), Path::new("sparse/0"));
        assert_eq!(colmap_folder(Path::new("a/transforms.json")), Path::new("a/sparse/0"));
        assert_eq!(colmap_folder(Path::new("transforms.json")), Path::new("sparse/0"));
        let BopFolders { scene, models } =
            BopFolders::of(Path::new("tower/train/000001/rgb/transforms.json"));
        assert_eq!((scene, models), ("tower/train/000001".into(), "tower/models".into()));
        let BopFolders { models, .. } = BopFolders::of(Path::new("train/000001/rgb/transforms.json"));
        assert_eq!(models, Path::new("models"));
    }
}
