//! Pictures that know what they were made from.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::SessionError;
use crate::fingerprint::fingerprint;
use crate::notice::Notice;
use crate::plan::SessionPlan;
use crate::planned_frame::PlannedFrame;
use blinn_output::{BitDepth, ImageFormat, Overwrite, save};
use blinn_scene::Source;

/// How an image is stored.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ImageKind {
    /// The file format.
    pub format: ImageFormat,
    /// Bits per channel.
    pub depth: BitDepth,
}

impl ImageKind {
    /// The kind that the extension of `path` names, with its default depth.
    ///
    /// # Errors
    /// No format has this extension.
    pub fn from_path(path: &Path) -> Result<ImageKind, SessionError> {
        let format = ImageFormat::from_path(path).ok_or_else(|| {
            let (path, extensions) = (path.display(), ImageFormat::EXTENSIONS);
            SessionError::Option(format!("{path}: unknown image format; the name must end in {extensions}"))
        })?;
        Ok(ImageKind { format, depth: BitDepth::Default })
    }
}

/// A rendered picture with its layers.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels, layers and the transform to display values.
    pub image: blinn_output::Picture,
    /// Warnings about it.
    pub notices: Vec<Notice>,
    pub(crate) plan: Arc<SessionPlan>,
    pub(crate) frame: PlannedFrame,
    pub(crate) scene: PathBuf,
    pub(crate) source: Arc<Source>,
}

impl Picture {
    /// Saves the picture; its layers as `NAME.<aov>.png` beside it, or in the file if that is an `.exr`. An existing file is
    /// replaced when the new one is complete. Returns the paths of all files.
    ///
    /// The file holds a fingerprint of what it was made from, with which `blinn render --resume` keeps it.
    ///
    /// # Errors
    /// The extension names no format, or a file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<Vec<PathBuf>, SessionError> {
        let path = path.as_ref();
        self.save_as(path, ImageKind::from_path(path)?, Overwrite::Yes)
    }

    /// Saves the picture as [`Picture::save`] does, in any format.
    ///
    /// # Errors
    /// A file cannot be written, or exists and must not be replaced.
    pub fn save_as(
        &self,
        path: &Path,
        kind: ImageKind,
        overwrite: Overwrite,
    ) -> Result<Vec<PathBuf>, SessionError> {
        let hash = self.plan.settings_hash(&kind, &self.frame);
        let image = blinn_output::Picture {
            fingerprint: fingerprint(hash, &self.scene, &self.source),
            ..self.image.clone()
        };
        Ok(save(&image, path, kind.format, kind.depth, overwrite)?)
    }
}
