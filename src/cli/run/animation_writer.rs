//! A moving picture that takes a scene's frames as they are finished.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Result;

use crate::cli::plan::Playing;
use crate::cli::run::report::Report;
use crate::output::{AnimationFile, AnimationSettings, Overwrite, Picture, encode_thumbnail};

/// All frames of a scene on their way into one file, which is there once they all are.
pub(crate) struct Reel {
    moving: AnimationFile,
    done: Done,
}

/// A finished moving picture.
pub(crate) struct Done {
    pub file: PathBuf,
    /// Its first frame as a small JPEG.
    pub small: Vec<u8>,
    /// The time that its frames took.
    pub took: Duration,
}

impl Reel {
    pub fn new(file: &Path, playing: &Playing, size: (u32, u32), replace: Overwrite) -> Result<Reel> {
        let Playing { format, fps, repeat, quality, clockwise } = *playing;
        let (width, height) = size;
        let settings =
            AnimationSettings { width, height, fps, repeat, quality, overwrite: replace, clockwise };
        let done = Done { file: file.to_path_buf(), small: Vec::new(), took: Duration::ZERO };
        Ok(Reel { moving: AnimationFile::create(file, format, &settings)?, done })
    }

    /// Adds the next frame.
    pub fn add(&mut self, picture: &Picture, took: Duration) -> Result<()> {
        if self.done.small.is_empty() {
            self.done.small = encode_thumbnail(picture, Report::SIDE)?;
        }
        self.done.took += took;
        Ok(self.moving.push(&picture.display.to_rgba8(&picture.pixels))?)
    }

    /// Writes the file.
    pub fn finish(self) -> Result<Done> {
        self.moving.finish()?;
        Ok(self.done)
    }
}
