//! Writes a dataset in the formats of COLMAP, BOP and COCO.
//!
//! Everything is computed from the scene and the cameras of all views, also of those that --only or --chunk leave out, so
//! that all tasks of a farm write the same files. Only masks and depth images belong to the views of a task.

mod bop;
mod bop_objects;
mod categories;
mod colmap;
mod context;
mod existing_bop_files;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;

use self::bop::BopWriter;
use self::bop_objects::BopObjects;
use self::categories::ObjectCategories;
use self::context::{DatasetContext, ImageMasks, NumberedView};
use crate::args::values::DatasetFormat;
use crate::plan::{DatasetFolders, RenderPlan, SceneNames};
use crate::run::dataset::TransformsFile;
use blinn_accel::Accel;
use blinn_core::cancellation::CancelToken;
use blinn_output::datasets::{CocoDataset, CocoObject, bop_sample_masks};
use blinn_render::MaskRect;
use blinn_render::integrator::Frame;
use blinn_scene::{Camera, PosedScene, Scene};
use blinn_session::BackFaceCulling;

pub use self::context::DatasetFiles;
pub use self::existing_bop_files::has_bop_files;

/// Extensions and texts of the files that a sample of an archive has beside its image and its camera.
pub type SampleFiles = Vec<(&'static str, String)>;

/// The categories of the objects of the scene in a file.
///
/// # Errors
/// A rule does not suit the scene.
pub fn categories(plan: &RenderPlan, scene: &Scene, file: &Path) -> Result<ObjectCategories> {
    ObjectCategories::new(plan, scene, &SceneNames::new(&plan.scenes, file))
}

impl DatasetFiles<'_> {
    /// Writes all files and returns those that describe all views.
    pub fn write(&self, cancel: &CancelToken) -> Result<Vec<PathBuf>> {
        let formats = &self.transforms.plan.formats;
        let has = |format: DatasetFormat| formats.has(format);
        let (has_masks, colmap) =
            (formats.coco_masks().is_some() || has(DatasetFormat::Bop), formats.colmap_form());
        if !has_masks && colmap.is_none() {
            return Ok(Vec::new());
        }
        let start = Instant::now();
        let posed = self.transforms.views.posed();
        let (accel, _) = Accel::build_cancellable(posed, &self.transforms.plan.session.build, cancel)?;
        let Some(context) = self.context(posed, &accel, cancel)? else { return Ok(Vec::new()) };
        let mut written = Vec::new();
        if has_masks {
            written.extend(self.write_masks(&context)?);
        }
        if let Some(form) = colmap {
            written.extend(self.write_colmap(&context, form)?);
        }
        self.log.stage_since("dataset", start, &format!("{} views", context.views.len()));
        Ok(written)
    }

    /// Returns the files of the views in an archive, by their number: COCO's annotations, in which ids of images count through
    /// all scenes, and BOP's poses and masks.
    pub fn sample_files(&self, cancel: &CancelToken) -> Result<BTreeMap<i64, SampleFiles>> {
        let TransformsFile { plan, path, scene, index, .. } = *self.transforms;
        if !plan.formats.describes_samples() {
            return Ok(BTreeMap::new());
        }
        let start = Instant::now();
        let categories = categories(plan, scene, path)?;
        let posed = self.transforms.views.posed();
        let (accel, _) = Accel::build_cancellable(posed, &plan.session.build, cancel)?;
        let Some(context) = self.context(posed, &accel, cancel)? else { return Ok(BTreeMap::new()) };
        let window = MaskRect::from(context.dataset.window);
        let size = (window.width, window.height);
        let bop = match plan.formats.has(DatasetFormat::Bop) {
            true => Some(BopObjects::new(self, posed)?),
            false => None,
        };
        let before = context.views.len().saturating_mul(index.saturating_sub(1)) as i64;
        let mut samples = BTreeMap::new();
        for NumberedView { number, view } in &context.views {
            let traced =
                if bop.is_some() { bop::canvas(&context.seen(view), &context.settings) } else { window };
            let masks = context.masks(view, traced, window)?;
            let mut files = SampleFiles::new();
            if let Some(form) = plan.formats.coco_masks() {
                let mut coco = CocoDataset::new(size, categories.all.clone(), form);
                coco.depth_step = context.dataset.depth_step;
                coco.add_image(before + number, &view.file, objects(&masks, scene, &categories));
                files.push(("coco.json", coco.to_json()));
            }
            if let Some(bop) = &bop {
                files.extend(bop.image(&context.dataset, view, &masks).sample_files());
                let masks = bop.with_models(&masks);
                let amodal = masks.iter().map(|mask| &mask.amodal);
                files.push(("mask.json", bop_sample_masks(size, amodal)));
                let visible = masks.iter().map(|mask| &mask.visible);
                files.push(("mask_visib.json", bop_sample_masks(size, visible)));
            }
            samples.insert(*number, files);
        }
        self.log.stage_since("dataset", start, &format!("{} views", samples.len()));
        Ok(samples)
    }

    /// Writes the models of a scene whose images go into an archive of BOP, and returns their files; none for other formats.
    pub fn write_archive_models(&self) -> Result<Vec<PathBuf>> {
        if !self.transforms.plan.formats.has(DatasetFormat::Bop) {
            return Ok(Vec::new());
        }
        BopObjects::new(self, self.transforms.views.posed())?.write_models()
    }

    /// The scene and the views for the formats; `None` without views.
    fn context<'p>(
        &self,
        posed: &'p PosedScene<'p>,
        accel: &'p Accel,
        cancel: &CancelToken,
    ) -> Result<Option<DatasetContext<'p>>> {
        let (dataset, views) = self.transforms.describe()?;
        let Some(camera) = views.first().map(|view| view.camera) else { return Ok(None) };
        let numbers = self.transforms.views.frames().map(|frame| frame.number);
        Ok(Some(DatasetContext {
            views: numbers.zip(views).map(|(number, view)| NumberedView { number, view }).collect(),
            frame: self.frame(posed, accel, camera),
            settings: self.transforms.plan.session.options.render_settings(dataset.size, 0.0),
            dataset,
            cancel: cancel.clone(),
        }))
    }

    /// Where the files are.
    fn folders(&self) -> DatasetFolders {
        let TransformsFile { plan, path, index, .. } = *self.transforms;
        plan.dataset_folders(path, index)
    }

    /// The posed scene with the faces, points and lines that eye rays hit.
    fn frame<'p>(&self, posed: &'p PosedScene<'p>, accel: &'p Accel, camera: Camera) -> Frame<'p> {
        let options = &self.transforms.plan.session.options;
        let lit = options.lighting.resolve(posed, &camera);
        let cull_back_faces = options.cull != BackFaceCulling::Off;
        let rounds = self.transforms.views.round_sizes(accel, &camera);
        Frame { cull_back_faces, rounds, ..Frame::new(posed, accel, camera, &lit) }
    }

    /// Writes what depends on the masks of objects: the formats of COCO and BOP.
    fn write_masks(&self, context: &DatasetContext) -> Result<Vec<PathBuf>> {
        let plan = self.transforms.plan;
        let scene = self.transforms.scene;
        let window = MaskRect::from(context.dataset.window);
        let categories = categories(plan, scene, self.transforms.path)?;
        let form = plan.formats.coco_masks();
        let mut coco =
            form.map(|form| CocoDataset::new((window.width, window.height), categories.all.clone(), form));
        if let Some(coco) = &mut coco {
            coco.depth_step = context.dataset.depth_step;
        }
        let mut bop = match plan.formats.has(DatasetFormat::Bop) {
            true => Some(BopWriter::new(self, context)?),
            false => None,
        };
        let own: BTreeSet<i64> =
            plan.frames.known().unwrap_or_default().iter().map(|frame| frame.number).collect();
        let mut written = Vec::new();
        for NumberedView { number, view } in &context.views {
            let traced =
                if bop.is_some() { bop::canvas(&context.seen(view), &context.settings) } else { window };
            let masks = context.masks(view, traced, window)?;
            if let Some(coco) = &mut coco {
                coco.add_image(*number, &view.file, objects(&masks, scene, &categories));
            }
            if let Some(bop) = &mut bop {
                written.extend(bop.add_view(*number, view, &masks, own.contains(number))?);
            }
        }
        if let Some(coco) = coco {
            written.extend(self.write_file(&self.folders().annotations, coco.to_json().as_bytes())?);
        }
        if let Some(bop) = bop {
            written.extend(bop.finish()?);
        }
        Ok(written)
    }
}

/// The objects that masks in an image show.
fn objects<'m>(
    masks: &'m [ImageMasks],
    scene: &'m Scene,
    categories: &'m ObjectCategories,
) -> impl Iterator<Item = CocoObject<'m>> {
    masks.iter().filter_map(|mask| {
        let category = categories.of(mask.object)?;
        let index = (mask.object as usize).checked_sub(1)?;
        let name = scene.objects.get(index).map_or("", String::as_str);
        let ImageMasks { object, ref visible, ref amodal, .. } = *mask;
        Some(CocoObject { object, name, category, visible, amodal })
    })
}
