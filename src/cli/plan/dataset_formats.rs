//! `--dataset`: the formats of a dataset.

use std::path::Path;
use std::sync::Arc;

use super::outputs::{OutputKind, Outputs, Target};
use super::shards::ShardPlan;
use super::shared_categories::SharedCategories;
use crate::args::TurnArgs;
use crate::args::values::{CategoryRule, DatasetFormat, DatasetFormats};
use crate::usage::UsageError;
use blinn_core::option_words::word_options;
use blinn_core::worded;
use blinn_output::datasets::{CocoMasks, ColmapForm};
use blinn_session::{DatasetPlan, ImageKind, PlannedFrame};

/// The formats of a dataset.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct FormatsPlan {
    formats: DatasetFormats,
    /// The first rule that applies to an object decides its category. Never empty.
    pub categories: Vec<CategoryRule>,
    /// True for one dataset of all scenes.
    pub is_merged: bool,
    /// True for models of BOP that scenes share.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub shares_models: bool,
    /// The ids of categories in archives.
    #[serde(skip)]
    pub shared_categories: Arc<SharedCategories>,
    /// The shared ids of the categories of a scene, in its own plan, if they depend on other scenes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub scene_categories: Vec<usize>,
}

/// The folder of images in datasets of BOP.
const BOP_IMAGES: &str = "rgb";

impl FormatsPlan {
    pub fn from_args(args: &TurnArgs) -> Result<FormatsPlan, UsageError> {
        let formats = args.dataset.clone().unwrap_or_default();
        let has_categories = !args.category.is_empty();
        let categories = if has_categories { args.category.clone() } else { vec![CategoryRule::Object] };
        let plan = FormatsPlan {
            formats,
            categories,
            is_merged: args.merge,
            shares_models: args.share_models,
            ..FormatsPlan::default()
        };
        if has_categories && plan.coco_masks().is_none() {
            return Err(UsageError(worded!("`category` applies only to `dataset` coco; add it")));
        }
        if plan.shares_models && !plan.has(DatasetFormat::Bop) {
            return Err(UsageError(worded!("`share-models` applies only to `dataset` bop; add it")));
        }
        if plan.is_merged && plan.formats.0 == [DatasetFormat::Nerf] {
            return Err(UsageError(worded!(
                "`merge`: transforms.json describes one scene; add coco, bop or colmap to `dataset`"
            )));
        }
        Ok(plan)
    }

    /// True if ids of categories depend on the names of all scenes.
    pub fn has_categories_of_scenes(&self) -> bool {
        let is_of_scenes = |rule: &CategoryRule| matches!(rule, CategoryRule::Scene | CategoryRule::Folder);
        self.shared_categories.count() > 0 && self.categories.iter().any(is_of_scenes)
    }

    /// True if categories follow from the content of scenes, which is not known before they are read.
    pub fn has_categories_of_content(&self) -> bool {
        let is_of_content =
            |rule: &CategoryRule| matches!(rule, CategoryRule::Object | CategoryRule::Material);
        self.categories.iter().any(is_of_content)
    }

    pub fn has(&self, format: DatasetFormat) -> bool {
        self.formats.0.contains(&format)
    }

    /// The name of images in a folder, where the formats or several scenes need folders of their own. With BOP, whose folders
    /// are fixed, the other formats are beside its images.
    pub fn image_name(&self, is_batch: bool) -> Option<&'static str> {
        let has_bop = self.has(DatasetFormat::Bop);
        match (has_bop, self.colmap_form().is_some(), is_batch || self.is_merged) {
            (true, ..) if self.is_merged => Some("train/{index:06}/rgb/######.png"),
            (false, true, _) if self.is_merged => Some("images/{stem}/####.png"),
            (true, _, false) => Some("train/000001/rgb/######.png"),
            // Each scene has models of its own.
            (true, _, true) => Some("{stem}/train/000001/rgb/######.png"),
            (false, true, false) => Some("images/####.png"),
            (false, true, true) => Some("{stem}/images/####.png"),
            (false, false, true) => Some("{stem}/####.png"),
            (false, false, false) => None,
        }
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

    /// True if samples of an archive have files of these formats beside their cameras.
    pub fn describes_samples(&self) -> bool {
        self.coco_masks().is_some() || self.has(DatasetFormat::Bop)
    }

    /// Checks that the formats support the names and folders of images. Names in COLMAP's model are relative to
    /// `colmap_images`.
    pub fn check_names(
        &self,
        dataset: &DatasetPlan,
        scene: &Path,
        index: usize,
        outputs: &Outputs,
        colmap_images: &Path,
    ) -> Result<(), UsageError> {
        for number in [1, i64::from(dataset.count)] {
            let Target::File(image) = outputs.target(scene, index, &PlannedFrame::at(number, dataset.time))
            else {
                continue;
            };
            if self.colmap_form().is_some() {
                let name = image.strip_prefix(colmap_images).unwrap_or(&image);
                check_colmap_name(name)?;
            }
            if self.has(DatasetFormat::Bop) {
                check_bop_name(&image, number, outputs)?;
            }
        }
        Ok(())
    }

    /// Returns an error if the formats do not suit what is written: archives have transforms, COCO's annotations and BOP's
    /// poses, sample by sample, and normalized scenes neither COLMAP's models nor BOP's poses. COCO's annotations have no coordinates of
    /// the scene.
    pub fn check_outputs(&self, outputs: &Outputs, is_normalized: bool) -> Result<(), UsageError> {
        let has_others = self.formats.0.iter().any(|format| *format != DatasetFormat::Nerf);
        let text = match () {
            () if !has_others => return Ok(()),
            () if outputs.shards.is_some() && self.colmap_form().is_some() => {
                "an archive describes each image by itself, and COLMAP's models all images of a scene; use `dataset` \
                 nerf,coco,bop"
            }
            () if outputs.shards.is_some() && self.is_merged => {
                "an archive describes each image by itself; remove `merge`"
            }
            () if self.shares_models && !self.is_merged && outputs.shards.is_none() => {
                return Err(UsageError(worded!(
                    "`share-models`: each scene has a folder of models of its own; add `merge`, or write archives"
                )));
            }
            () if is_normalized && (self.has(DatasetFormat::Bop) || self.colmap_form().is_some()) => {
                "bop and colmap have the scene's own coordinates; remove `normalize`, or use nerf and coco"
            }
            () => {
                return match &outputs.shards {
                    Some(shards) if self.has(DatasetFormat::Bop) => check_bop_archives(shards, outputs),
                    _ => Ok(()),
                };
            }
        };
        Err(UsageError(worded!("`dataset`: {}", word_options(text))))
    }
}

fn check_colmap_name(name: &Path) -> Result<(), UsageError> {
    let name = name.to_string_lossy();
    if name.contains(char::is_whitespace) {
        let text = worded!(
            "`dataset` colmap: COLMAP reads no spaces in names of images, such as {}; set another name with `output`",
            name
        );
        return Err(UsageError(text));
    }
    Ok(())
}

/// Returns an error for archives that BOP's tools do not read.
fn check_bop_archives(shards: &ShardPlan, outputs: &Outputs) -> Result<(), UsageError> {
    let text = match outputs.member_extension().as_str() {
        "png" | "jpg" if shards.folder().is_some() => return Ok(()),
        "png" | "jpg" => {
            "the models of all scenes are beside the archives; set `output` to a name with {shard:06} in its last part, such \
             as train_web/shard-{shard:06}.tar"
        }
        _ => {
            "BOP's tools read .png and .jpg in archives; set `output` to a name such as shard-{shard:06}.tar or \
             shard-{shard:06}.jpg.tar"
        }
    };
    Err(UsageError(worded!("`dataset` bop: {}", word_options(text))))
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
    Err(UsageError(worded!(
        "`dataset` bop: BOP's tools read images named ROOT/SPLIT/SCENE/rgb/000001.png; set `output` ROOT/ or \
         `output` ROOT/train/000001/rgb/######.png"
    )))
}
