//! Writes the frames of a scene into one animation file.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Result;

use super::report::THUMBNAIL_SIDE;
use crate::plan::AnimationOutput;
use blinn_output::{AnimationFile, AnimationSettings, Overwrite, Picture, encode_thumbnail};

/// An animation that takes frames as they are finished. The file appears when all frames are in it.
pub struct AnimationWriter {
    animation: AnimationFile,
    written: WrittenAnimation,
}

/// A finished animation.
pub struct WrittenAnimation {
    pub file: PathBuf,
    /// The first frame as a small JPEG.
    pub thumbnail: Vec<u8>,
    /// Render time of all frames.
    pub render_time: Duration,
}

impl AnimationWriter {
    pub fn new(
        file: &Path,
        output: &AnimationOutput,
        size: (u32, u32),
        overwrite: Overwrite,
    ) -> Result<AnimationWriter> {
        let AnimationOutput { format, fps, loops, quality, clockwise, .. } = *output;
        let (width, height) = size;
        let settings = AnimationSettings { width, height, fps, repeat: loops, quality, overwrite, clockwise };
        let written =
            WrittenAnimation { file: file.to_path_buf(), thumbnail: Vec::new(), render_time: Duration::ZERO };
        Ok(AnimationWriter { animation: AnimationFile::create(file, format, &settings)?, written })
    }

    /// Appends a frame.
    pub fn add(&mut self, picture: &Picture, render_time: Duration) -> Result<()> {
        if self.written.thumbnail.is_empty() {
            self.written.thumbnail = encode_thumbnail(picture, THUMBNAIL_SIDE)?;
        }
        self.written.render_time += render_time;
        Ok(self.animation.push(&picture.display.to_rgba8(&picture.pixels))?)
    }

    /// Completes the file.
    pub fn finish(self) -> Result<WrittenAnimation> {
        self.animation.finish()?;
        Ok(self.written)
    }
}
