//! The sparse model of COLMAP.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use glam::DVec2;

use super::context::{DatasetContext, DatasetFiles, NumberedView};
use crate::files::with_slashes;
use blinn_core::worded;
use blinn_output::datasets::{ColmapForm, ColmapImage, ColmapModel, ColmapPoint, Pinhole, RigidPose};
use blinn_render::trace_surface_tracks;
use blinn_scene::{Camera, linear_to_srgb8};

/// Points that are chosen on the surface; those that several images see are written.
const POINTS: usize = 20_000;
/// Most images in which points are searched, evenly distributed over all.
const MAX_IMAGES: usize = 512;

impl DatasetFiles<'_> {
    /// Writes the model and returns its files.
    pub(super) fn write_colmap(&self, context: &DatasetContext, form: ColmapForm) -> Result<Vec<PathBuf>> {
        let DatasetContext { dataset, views, frame, settings, cancel } = context;
        let folders = self.folders();
        let image_folder =
            folders.transforms.parent().and_then(|folder| folder.strip_prefix(&folders.colmap_images).ok());
        let image = |view: &NumberedView| ColmapImage {
            name: with_slashes(&image_folder.unwrap_or(Path::new("")).join(&view.view.file)),
            pinhole: Pinhole::new(&view.view.camera, dataset.size, dataset.window),
            world_to_camera: RigidPose::world_to_camera(&view.view.camera, dataset.up),
        };
        let step = views.len().div_ceil(MAX_IMAGES).max(1);
        let cameras: Vec<Camera> = views.iter().step_by(step).map(|view| view.view.camera).collect();
        let tracks = trace_surface_tracks(frame, &cameras, settings, POINTS, cancel)?;
        let corner = DVec2::new(dataset.window.x.into(), dataset.window.y.into());
        let points = tracks.into_iter().map(|track| ColmapPoint {
            position: dataset.up.rotation() * track.position,
            color: track.color.to_array().map(linear_to_srgb8),
            observations: track
                .observations
                .into_iter()
                .map(|(view, pixel)| (view as usize * step, pixel - corner))
                .collect(),
        });
        let model = ColmapModel {
            points: points.collect(),
            images: views.iter().map(image).collect(),
            first_image: self.first_image(views.len())?,
        };
        let mut written = Vec::new();
        for (name, bytes) in form.names().into_iter().zip(model.files(form)) {
            written.extend(self.write_file(&folders.colmap.join(name), &bytes)?);
        }
        Ok(written)
    }

    /// The number of images of the models before, with ids of their own.
    fn first_image(&self, views: usize) -> Result<u32> {
        let before = self.transforms.plan.images_before(self.transforms.index);
        // COLMAP's ids of images end at 2³¹ − 1.
        let last = before.and_then(|before| before.checked_add(i64::try_from(views).ok()?));
        last.and_then(|last| i32::try_from(last).ok())
            .context(worded!("`merge`: there are too many images for COLMAP"))?;
        Ok(u32::try_from(before.unwrap_or_default())?)
    }
}
