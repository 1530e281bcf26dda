//! Where the images of a scene go: files, an archive, or an animation.

mod animation;
mod archive;
mod files;

use std::path::Path;
use std::time::Duration;

use anyhow::Result;

use super::progress::SceneLog;
use crate::plan::{RenderPlan, Target};
use blinn_scene::Scene;
use blinn_session::{ImageCamera, PlannedFrame, RenderedImage, fingerprint, mark_empty};

pub use animation::AnimationSink;
pub use archive::ArchiveSink;
pub use files::FileSink;

/// Takes the images of a scene, in the order of their frames.
pub trait ImageSink {
    /// Takes an image.
    fn add(
        &mut self,
        frame: &PlannedFrame,
        image: &mut RenderedImage,
        render_time: Duration,
    ) -> Result<WrittenFiles>;

    /// Completes what holds all images.
    fn finish(self: Box<Self>) -> Result<WrittenFiles> {
        Ok(WrittenFiles::default())
    }
}

/// Files that were written.
#[derive(Clone, Copy, Debug, Default)]
pub struct WrittenFiles {
    pub files: u64,
    pub bytes: u64,
}

impl WrittenFiles {
    /// Counts a file that exists.
    pub fn add_file(&mut self, file: &Path) {
        self.files += 1;
        self.bytes += file.metadata().map_or(0, |file| file.len());
    }
}

/// The scene whose images a sink takes.
#[derive(Clone, Copy)]
pub struct SceneOutput<'a> {
    pub plan: &'a RenderPlan,
    pub scene: &'a Scene,
    /// The scene's file.
    pub path: &'a Path,
    /// The scene's number, from 1.
    pub index: usize,
    pub log: &'a SceneLog<'a>,
}

impl SceneOutput<'_> {
    /// Where the image of a frame goes.
    pub fn target(&self, frame: &PlannedFrame) -> Target {
        self.plan.outputs.target(self.path, self.index, frame)
    }

    fn fingerprint(&self, frame: &PlannedFrame, image: &RenderedImage) -> Option<String> {
        image_fingerprint(self.plan, frame, image.view, self.path, self.scene, image.empty.is_some())
    }
}

/// The fingerprint of an image in its file. `view` is its camera, `is_empty` says that it shows nothing.
pub fn image_fingerprint(
    plan: &RenderPlan,
    frame: &PlannedFrame,
    view: Option<ImageCamera>,
    path: &Path,
    scene: &Scene,
    is_empty: bool,
) -> Option<String> {
    let has_view = plan.session.dataset.is_some() || plan.session.cameras.is_some();
    let hash = match view.filter(|_| has_view) {
        Some(view) => plan.view_hash(frame, &view),
        None => plan.settings_hash(frame),
    };
    let fingerprint = fingerprint(hash, path, &scene.source)?;
    let is_marked = is_empty && plan.session.dataset.is_some();
    Some(if is_marked { mark_empty(&fingerprint) } else { fingerprint })
}
