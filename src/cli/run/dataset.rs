//! Where the pictures of a dataset were taken from, in a file beside them.

use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::batch::{Dataset, DatasetView};
use crate::cli::plan::{Job, Target, Views};
use crate::integrator::Aov;
use crate::output::{Overwrite, SaveError, check_overwrite, write_atomically};
use crate::render::RenderSettings;
use crate::scene::pose;
use crate::scene::{ClipBoundsCache, PoseSettings, PosedScene, Scene, clip_duration};

/// The keys by which tools look for a layer.
const KEYS: [(Aov, &[&str]); 3] = [
    (Aov::Depth, &["depth_path", "depth_file_path"]),
    (Aov::Normal, &["normal_file_path"]),
    (Aov::Mask, &["mask_path"]),
];

/// That file, of one scene: read from `path`, the `index`-th of the job.
pub(crate) struct DatasetFile<'a> {
    pub job: &'a Job,
    pub views: &'a Views,
    pub scene: &'a Scene,
    pub path: &'a Path,
    pub index: usize,
}

impl DatasetFile<'_> {
    /// Writes it, and returns where unless it is there already and stays. It is of all views, whichever
    /// were rendered: those of a farm's shares are the same. `clip_bounds_cache` is what the pictures' moments shared.
    pub fn write(&self, clip_bounds_cache: &ClipBoundsCache) -> Result<Option<PathBuf>> {
        let (file, replace) = (self.file(), self.job.outputs.replace);
        let text = self.text(clip_bounds_cache)?;
        match write_atomically(&file, text.as_bytes(), replace) {
            Ok(()) => Ok(Some(file)),
            // Another share's is this one's.
            Err(_) if replace == Overwrite::No && holds(&file, &text) => Ok(None),
            Err(cause) => Err(SaveError { path: file, cause }.into()),
        }
    }

    /// Refuses a file that is there and must stay, unless it is what would be written.
    pub fn check(&self) -> Result<()> {
        let file = self.file();
        let Err(error) = check_overwrite(&file, self.job.outputs.replace) else { return Ok(()) };
        if file.is_file() && holds(&file, &self.text(&ClipBoundsCache::default())?) {
            return Ok(());
        }
        Err(error.into())
    }

    fn file(&self) -> PathBuf {
        self.views.file(&self.job.outputs, self.path, self.index)
    }

    fn text(&self, clip_bounds_cache: &ClipBoundsCache) -> Result<String> {
        let DatasetFile { job, views, scene, path, index } = *self;
        let Job { look, outputs, .. } = job;
        let animation = look.animation(scene)?;
        let time = views.time.min(clip_duration(scene, &animation)?);
        let start = pose(scene, &PoseSettings { time: 0.0, animation, centre: None })?
            .with_clip_bounds_cache(clip_bounds_cache);
        let posed = start.at_time(time);
        let size @ (width, height) = look.size_for(scene);
        let mut all = Vec::new();
        for shot in views.shots() {
            let target = outputs.target(path, index, &shot);
            let Target::File(picture) = &target else { continue };
            let name = |file: &Path| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let files = outputs.files(&target);
            let beside = |aov: Aov| {
                let expected = picture.with_extension(format!("{}.png", aov.name()));
                files.iter().find(|file| **file == expected).map(|file| name(file))
            };
            let layers = KEYS.iter().filter_map(|&(aov, keys)| Some((keys, beside(aov)?)));
            let layers = layers.flat_map(|(keys, file)| keys.iter().map(move |&key| (key, file.clone())));
            all.push(DatasetView {
                file: name(picture),
                layers: layers.collect(),
                camera: look.camera(&shot, &posed, size)?,
            });
        }
        let dataset = Dataset {
            size,
            window: RenderSettings { width, height, ..look.settings }.window(),
            up: views.up,
            bounds: posed.bounds(),
            depth_step: depth_step(job, &start, size)?,
        };
        Ok(dataset.to_json(&all))
    }
}

fn holds(file: &Path, text: &str) -> bool {
    std::fs::read(file).is_ok_and(|bytes| bytes == text.as_bytes())
}

/// Metres that a step of 16-bit depth stands for: whatever a view could see has one. `None` where depth is
/// not written so.
pub(crate) fn depth_step(job: &Job, posed: &PosedScene, size: (u32, u32)) -> Result<Option<f64>> {
    let Some(shot) = job.views.and_then(|views| views.shots().next()) else { return Ok(None) };
    if job.outputs.holds_layers() {
        return Ok(None);
    }
    let sphere = posed.clip_sphere();
    let middle = job.look.view.look_at.unwrap_or(sphere.centre);
    let camera = job.look.camera(&shot, posed, size)?;
    let farthest = camera.view_point.distance(middle) + middle.distance(sphere.centre) + sphere.radius;
    // A number that can be typed, and no less than is needed.
    let step: f64 = format!("{:.2e}", 1.01 * farthest / f64::from(u16::MAX)).parse().unwrap_or(0.0);
    Ok(Some(if step > 0.0 { step } else { 1.0 }))
}
