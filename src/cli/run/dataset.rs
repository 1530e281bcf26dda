//! Writes `transforms.json`: the cameras of a dataset's images.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::plan::{DatasetPlan, ImageCamera, PlannedFrame, RenderPlan, Target};
use blinn_output::datasets::{Dataset, DatasetView};
use blinn_output::{Overwrite, SaveError, check_overwrite, write_atomically};
use blinn_render::RenderSettings;
use blinn_render::integrator::Aov;
use blinn_scene::pose;
use blinn_scene::{
    ClipBoundsCache, DEFAULT_BASELINE, DistanceRange, LightRotation, Normalization, PoseSettings, PosedScene,
    SampledView, Scene, StereoEye, clip_duration,
};

/// Keys under which NeRF tools look for an AOV.
const AOV_KEYS: [(Aov, &[&str]); 3] = [
    (Aov::Depth, &["depth_path", "depth_file_path"]),
    (Aov::Normal, &["normal_file_path"]),
    (Aov::Mask, &["mask_path"]),
];

/// The `transforms.json` of one scene.
pub struct TransformsFile<'a> {
    pub plan: &'a RenderPlan,
    pub dataset: &'a DatasetPlan,
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
    /// `clip_bounds` holds the clip bounds that the images used; `views_shown` says which images show something.
    pub fn write(
        &self,
        clip_bounds: &ClipBoundsCache,
        views_shown: &BTreeMap<String, bool>,
    ) -> Result<Option<PathBuf>> {
        let file = self.file();
        let replace = self.plan.outputs.replace;
        let (dataset, mut views) = self.describe(clip_bounds)?;
        let marked = marks_of_same(&file, &dataset, &views).unwrap_or_default();
        for view in &mut views {
            let is_shown = views_shown.get(&view.file);
            view.is_empty = is_shown.map_or_else(|| marked.contains(&view.file), |is_shown| !is_shown);
        }
        match write_atomically(&file, dataset.to_json(&views).as_bytes(), replace) {
            Ok(()) => Ok(Some(file)),
            // Another task wrote the same file, or writes it now.
            Err(_) if replace == Overwrite::No && marks_of_same(&file, &dataset, &views).is_some() => {
                Ok(None)
            }
            Err(cause) => Err(SaveError { path: file, cause }.into()),
        }
    }

    /// Returns an error if --no-overwrite keeps a file with other content.
    pub fn check(&self, clip_bounds: &ClipBoundsCache) -> Result<()> {
        let file = self.file();
        let Err(error) = check_overwrite(&file, self.plan.outputs.replace) else { return Ok(()) };
        if file.is_file() {
            let (dataset, views) = self.describe(clip_bounds)?;
            if marks_of_same(&file, &dataset, &views).is_some() {
                return Ok(());
            }
        }
        Err(error.into())
    }

    pub fn file(&self) -> PathBuf {
        self.dataset.transforms_file(&self.plan.outputs, self.path, self.index)
    }

    /// The scene at the start of its clip, and at the time of the dataset.
    pub fn pose(&self, clip_bounds: &ClipBoundsCache) -> Result<(PosedScene<'_>, PosedScene<'_>)> {
        let TransformsFile { plan, dataset, scene, .. } = *self;
        let animation = plan.options.animation(scene)?;
        let time = dataset.time.min(clip_duration(scene, &animation)?);
        let start = pose(scene, &PoseSettings { time: 0.0, animation, centre: None })?
            .with_clip_bounds_cache(clip_bounds);
        // All views are placed by them.
        start.clip_bounds();
        clip_bounds.check()?;
        let posed = start.at_time(time);
        Ok((start, posed))
    }

    /// The content of the file, without marks of empty images.
    pub fn describe(&self, clip_bounds: &ClipBoundsCache) -> Result<(Dataset, Vec<DatasetView>)> {
        let TransformsFile { plan, dataset, scene, .. } = *self;
        let options = &plan.options;
        let (start, posed) = self.pose(clip_bounds)?;
        let size = options.size_for(scene);
        let (width, height) = size;
        let dataset = Dataset {
            size,
            window: RenderSettings { width, height, ..options.settings }.window(),
            up: dataset.up,
            time: dataset.time,
            bounds: posed.bounds(),
            depth_step: depth_step(plan, &start, size)?,
            normalization: options.normalize.map(|_| options.normalization(&start)),
            sampling: dataset.sampling,
        };
        let views = self.views(&posed, size)?;
        Ok((dataset, views))
    }

    /// File names and cameras of all views.
    fn views(&self, posed: &PosedScene, size: (u32, u32)) -> Result<Vec<DatasetView>> {
        let TransformsFile { plan, dataset, path, index, .. } = *self;
        let name = |file: &Path| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut views = Vec::new();
        for frame in dataset.frames() {
            let target = plan.outputs.target(path, index, &frame);
            let Target::File(image) = &target else { continue };
            let files = plan.outputs.files(&target);
            let preview = |aov: Aov| {
                let expected = image.with_extension(format!("{}.png", aov.name()));
                files.iter().find(|file| **file == expected).map(|file| name(file))
            };
            let previews = AOV_KEYS.iter().filter_map(|&(aov, keys)| Some((keys, preview(aov)?)));
            let layers = previews.flat_map(|(keys, file)| keys.iter().map(move |&key| (key, file.clone())));
            views.push(DatasetView {
                file: name(image),
                layers: layers.collect(),
                camera: plan.options.camera(&frame, posed, size)?,
                light: frame.view.map_or(LightRotation::default(), |view| view.light),
                is_empty: false,
            });
        }
        Ok(views)
    }
}

/// The scene as all views of a dataset see it.
pub struct DatasetViews<'s> {
    plan: &'s RenderPlan,
    posed: PosedScene<'s>,
    size: (u32, u32),
    depth_step: Option<f64>,
    normalization: Option<Normalization>,
}

impl<'s> DatasetViews<'s> {
    pub fn new(
        plan: &'s RenderPlan,
        dataset: &DatasetPlan,
        scene: &'s Scene,
        clip_bounds: &ClipBoundsCache,
    ) -> Result<DatasetViews<'s>> {
        let animation = plan.options.animation(scene)?;
        let time = dataset.time.min(clip_duration(scene, &animation)?);
        let start = pose(scene, &PoseSettings { time: 0.0, animation, centre: None })?
            .with_clip_bounds_cache(clip_bounds);
        start.clip_bounds();
        clip_bounds.check()?;
        let size = plan.options.size_for(scene);
        let depth_step = depth_step(plan, &start, size)?;
        let normalization = plan.options.normalize.map(|_| plan.options.normalization(&start));
        Ok(DatasetViews { plan, posed: start.at_time(time), size, depth_step, normalization })
    }

    /// The camera of a view.
    pub fn view(&self, frame: &PlannedFrame) -> Result<ImageCamera> {
        Ok(ImageCamera {
            camera: self.plan.options.camera(frame, &self.posed, self.size)?,
            size: self.size,
            crop: self.plan.options.settings.crop,
            depth_step: self.depth_step,
            light: frame.view.map_or(LightRotation::default(), |view| view.light),
            normalization: self.normalization,
        })
    }
}

/// The images that an existing file marks as empty, if the rest of its content is the same.
fn marks_of_same(file: &Path, dataset: &Dataset, views: &[DatasetView]) -> Option<BTreeSet<String>> {
    let text = std::fs::read_to_string(file).ok()?;
    let marked = Dataset::empty_images(&text);
    let with_mark =
        |view: &DatasetView| DatasetView { is_empty: marked.contains(&view.file), ..view.clone() };
    let views: Vec<DatasetView> = views.iter().map(with_mark).collect();
    (dataset.to_json(&views) == text).then_some(marked)
}

/// Metres, or units of --normalize, per step of a dataset's 16-bit depth images, so that every point that a view can see
/// has a depth. `None` if there are no such images.
pub fn depth_step(plan: &RenderPlan, posed: &PosedScene, size: (u32, u32)) -> Result<Option<f64>> {
    if plan.options.depth_unit.is_some() {
        return Ok(plan.options.depth_unit);
    }
    let Some(first) = plan.dataset.and_then(|dataset| dataset.frames().next()) else { return Ok(None) };
    if plan.outputs.holds_aovs() {
        return Ok(None);
    }
    let sphere = posed.clip_sphere();
    let centre = plan.options.view.look_at.unwrap_or(sphere.centre);
    let options = &plan.options;
    let scale = options.normalization(posed).scale;
    let framed = PlannedFrame { view: first.view.map(|view| SampledView::at(view.orbit)), ..first };
    let framed = options.camera(&framed, posed, size)?.view_point.distance(centre);
    let distance = match plan.dataset.and_then(|dataset| dataset.sampling.distance) {
        None => framed,
        Some(DistanceRange::Framed(_, high)) => high * framed,
        Some(DistanceRange::Metres(_, high)) => high / scale,
    };
    let stereo = match first.view.and_then(|view| view.stereo) {
        Some(StereoEye { baseline, .. }) => {
            0.5 * baseline.map_or(DEFAULT_BASELINE * distance, |baseline| baseline / scale)
        }
        None => 0.0,
    };
    let farthest = (distance + stereo + centre.distance(sphere.centre) + sphere.radius) * scale;
    // Three digits, rounded up by at most 1 %, are easy to type.
    let step: f64 = format!("{:.2e}", 1.01 * farthest / f64::from(u16::MAX)).parse().unwrap_or(0.0);
    Ok(Some(if step > 0.0 { step } else { 1.0 }))
}
