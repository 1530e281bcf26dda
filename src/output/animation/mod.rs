//! Animation files: GIF, APNG, WebP, MP4 and HTML. Frames are added one by one, and the file appears when it is
//! complete.
//!
//! Each frame is encoded at once into an unnamed temporary file, so memory does not grow with the number of frames.

mod apng;
mod dirty_rect;
mod encoder;
mod format;
mod frame_timing;
mod gif;
mod html;
mod mp4;
mod palette;
mod spool;
#[cfg(test)]
mod tests;
mod webp;
mod yuv;

use std::path::{Path, PathBuf};

use super::save::SaveError;
use encoder::{Encoder, invalid_input};
use spool::Spool;

pub use encoder::AnimationSettings;
pub use format::{ANIMATION_QUALITY, AnimationFormat};

/// An animation file that is being written.
pub struct AnimationFile {
    path: PathBuf,
    settings: AnimationSettings,
    encoder: Box<dyn Encoder>,
    body: Spool,
    frame_count: u64,
}

impl AnimationFile {
    /// Starts an animation. No file exists at `path` before [`AnimationFile::finish`].
    ///
    /// # Errors
    /// The format does not support the size or frame rate, or no file can be created at `path`.
    pub fn create(
        path: &Path,
        format: AnimationFormat,
        settings: &AnimationSettings,
    ) -> Result<AnimationFile, SaveError> {
        let create = || {
            format.check_size((settings.width, settings.height)).map_err(invalid_input)?;
            format.check_rate(settings.fps).map_err(invalid_input)?;
            let encoder = format.encoder(path, settings)?;
            let body = Spool::create(path, settings.overwrite)?;
            Ok(AnimationFile { path: path.to_path_buf(), settings: *settings, encoder, body, frame_count: 0 })
        };
        create().map_err(|e| SaveError::new(path, e))
    }

    /// Adds a frame: display values with straight alpha, row-major, row 0 on top.
    ///
    /// # Errors
    /// The frame has another size, the format cannot represent it, or the disk is full.
    pub fn push(&mut self, rgba: &[[u8; 4]]) -> Result<(), SaveError> {
        let AnimationSettings { width, height, .. } = self.settings;
        let result = if rgba.len() as u64 == u64::from(width) * u64::from(height) {
            self.encoder.frame(rgba, &mut self.body)
        } else {
            Err(invalid_input(format!("a frame of {} pixels is not {width}x{height}", rgba.len())))
        };
        self.frame_count += 1;
        result.map_err(|e| SaveError::new(&self.path, e))
    }

    /// Completes the file and publishes it under its name.
    ///
    /// # Errors
    /// There are no frames, or the file cannot be written. No file exists then.
    pub fn finish(self) -> Result<(), SaveError> {
        let AnimationFile { path, settings, encoder, mut body, frame_count } = self;
        let publish = || {
            if frame_count == 0 {
                return Err(invalid_input("the animation has no frames".into()));
            }
            let head = encoder.finish(&mut body)?;
            body.publish(&head, &path, settings.overwrite)
        };
        publish().map_err(|e| SaveError::new(&path, e))
    }
}
