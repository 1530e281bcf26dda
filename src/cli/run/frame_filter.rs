//! The frames that `--resume` keeps.

use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::plan::{RenderPlan, Target};
use blinn_output::check_overwrite;
use blinn_session::{DatasetViews, FileDigests, PlannedFrame};

/// Divides the frames of a scene into those that are up to date and those to render.
pub struct FrameFilter<'a> {
    pub plan: &'a RenderPlan,
    /// The scene's file.
    pub path: &'a Path,
    /// The scene's number, from 1.
    pub index: usize,
}

/// An image of an earlier run that is up to date.
pub struct KeptFile {
    pub file: PathBuf,
    /// True for an image of a dataset that shows nothing.
    pub is_empty: bool,
}

impl FrameFilter<'_> {
    /// Removes the frames whose images are up to date, and returns these images. `views` are those of a dataset.
    pub fn remove_kept(
        &self,
        frames: &mut Vec<PlannedFrame>,
        views: Option<&DatasetViews>,
        digests: &mut FileDigests,
    ) -> Vec<KeptFile> {
        let FrameFilter { plan, path, index } = *self;
        let mut kept_files = Vec::new();
        frames.retain(|frame| {
            let hash = match (views, &plan.session.cameras, frame.camera) {
                (Some(views), ..) => views.view(frame).ok().map(|view| plan.view_hash(frame, &view)),
                (None, Some(cameras), Some(index)) => {
                    cameras.camera(index).ok().map(|view| plan.view_hash(frame, &view))
                }
                _ => Some(plan.settings_hash(frame)),
            };
            // A camera that is not found is an error when its image is rendered.
            let Some(hash) = hash else { return true };
            let target = plan.outputs.target(path, index, frame);
            let Some(kept) = plan.outputs.up_to_date(&target, hash, path, digests) else { return true };
            if let Target::File(file) = target {
                kept_files.push(KeptFile { file, is_empty: kept.is_empty });
            }
            false
        });
        kept_files
    }

    /// Returns an error if a file exists that --no-overwrite keeps. The files that describe all views are checked by their
    /// content, as all tasks of a farm write them.
    pub fn check_not_kept(&self, files: &[PathBuf]) -> Result<()> {
        let shared = self.plan.dataset_files(self.path, self.index);
        let mut images = files.iter().filter(|file| !shared.contains(file));
        images.try_for_each(|file| Ok(check_overwrite(file, self.plan.outputs.replace)?))
    }
}
