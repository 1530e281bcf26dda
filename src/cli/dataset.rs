//! Where the pictures of a dataset were taken from, in a file beside them.

use std::path::{Path, PathBuf};

use anyhow::Result;

use super::job::{Job, Target, Views};
use crate::batch::{Dataset, DatasetView};
use crate::integrator::Aov;
use crate::output::{SaveError, write_atomically};
use crate::render::RenderSettings;
use crate::scene::{OverClip, PoseSettings, PosedScene, Scene, clip_end, pose};

/// The keys by which tools look for a layer.
const KEYS: [(Aov, &[&str]); 3] = [
    (Aov::Depth, &["depth_path", "depth_file_path"]),
    (Aov::Normal, &["normal_file_path"]),
    (Aov::Mask, &["mask_path"]),
];

/// Writes it for the `index`-th scene. It is of all views, whichever were rendered: those of a farm's
/// shares are the same. `over_clip` is what the pictures' moments shared.
pub(super) fn write(
    job: &Job,
    views: &Views,
    scene: &Scene,
    over_clip: &OverClip,
    path: &Path,
    index: usize,
) -> Result<PathBuf> {
    let Job { look, outputs, .. } = job;
    let animation = look.animation(scene)?;
    let time = views.time.min(clip_end(scene, &animation)?);
    let start = pose(scene, &PoseSettings { time: 0.0, animation, centre: None })?.sharing(over_clip);
    let posed = start.at(time);
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
    let file = views.file(outputs, path, index);
    let written = write_atomically(&file, dataset.transforms(&all).as_bytes(), outputs.replace);
    written.map_err(|cause| SaveError { path: file.clone(), cause })?;
    Ok(file)
}

/// Metres that a step of 16-bit depth stands for: whatever a view could see has one. `None` where depth is
/// not written so.
pub(super) fn depth_step(job: &Job, posed: &PosedScene, size: (u32, u32)) -> Result<Option<f64>> {
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
