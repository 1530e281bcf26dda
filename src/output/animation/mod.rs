//! Moving pictures: frames go in one by one, and a file appears when they are all there.
//!
//! Frames are encoded as they come, into a nameless file; memory does not grow with their number.

mod apng;
mod dirty_rect;
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

use std::io;
use std::path::{Path, PathBuf};

use crate::output::{Overwrite, SaveError};
use spool::Spool;

/// File formats for moving pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnimationFormat {
    /// 255 colours a frame, alpha on or off; at most 50 frames a second.
    Gif,
    /// Without loss, straight alpha.
    Apng,
    /// Lossy, or without loss at quality 100; straight alpha.
    Webp,
    /// H.264, 4:2:0, opaque; at most 3840x2160. Odd sides get a pixel more.
    Mp4,
    /// One page that needs nothing else, in which the picture is turned by drag, keys and touch; frames as
    /// in WebP. `#play` behind its address starts it.
    Html,
}

impl AnimationFormat {
    /// Whether it can be shown at so many frames a second.
    ///
    /// # Errors
    /// A sentence about a rate that it cannot hold, and what to do.
    pub fn check_rate(self, fps: f64) -> Result<(), String> {
        match self {
            _ if !(fps.is_finite() && fps > 0.0) => Err(format!("{fps} is no number of frames a second")),
            AnimationFormat::Gif => gif::check_rate(fps),
            AnimationFormat::Apng => apng::check_rate(fps),
            AnimationFormat::Webp => webp::check_rate(fps),
            AnimationFormat::Mp4 => mp4::check_rate(fps),
            AnimationFormat::Html => Ok(()),
        }
    }

    /// Whether it can hold pictures of so many columns and rows.
    ///
    /// # Errors
    /// A sentence about a size that it cannot hold.
    pub fn check_size(self, size: (u32, u32)) -> Result<(), String> {
        match self {
            _ if size.0 == 0 || size.1 == 0 => Err("a picture has at least one pixel".into()),
            AnimationFormat::Gif => gif::check_size(size),
            AnimationFormat::Apng => Ok(()),
            AnimationFormat::Webp | AnimationFormat::Html => webp::check_size(size),
            AnimationFormat::Mp4 => mp4::check_size(size),
        }
    }

    /// By a file name's ending. A `.webp` may also be a single picture.
    pub fn from_path(path: &Path) -> Option<AnimationFormat> {
        match path.extension()?.to_ascii_lowercase().to_str()? {
            "gif" => Some(AnimationFormat::Gif),
            "apng" => Some(AnimationFormat::Apng),
            "webp" => Some(AnimationFormat::Webp),
            "mp4" => Some(AnimationFormat::Mp4),
            "html" => Some(AnimationFormat::Html),
            _ => None,
        }
    }

    /// Whether quality means anything.
    pub fn has_quality(self) -> bool {
        matches!(self, AnimationFormat::Webp | AnimationFormat::Mp4 | AnimationFormat::Html)
    }
}

/// The quality where none is given.
pub const ANIMATION_QUALITY: u8 = 90;

/// What all frames share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnimationSettings {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Frames a second.
    pub fps: f64,
    /// Whether it starts over for ever; else it is shown once and stops at its last frame.
    pub repeat: bool,
    /// 1 to 100, for formats that lose something.
    pub quality: u8,
    /// What becomes of a file that is there already.
    pub overwrite: Overwrite,
    /// Whether what turns does so clockwise, as seen from above: drags on a page take it along.
    pub clockwise: bool,
}

/// A moving picture that is being written.
pub struct AnimationFile {
    path: PathBuf,
    settings: AnimationSettings,
    encoder: Box<dyn Encoder>,
    body: Spool,
    frames: u64,
}

/// What a format does with frames. What it writes is the file's body: often its head has to say what is
/// known only at the end.
trait Encoder: Send {
    /// Encodes one more frame, of the right size.
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()>;

    /// Writes what comes after all frames, and returns what stands before them.
    fn finish(self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>>;
}

impl AnimationFile {
    /// Begins a moving picture. There is no file at `path` before [`AnimationFile::finish`].
    ///
    /// # Errors
    /// Sizes and rates that the format cannot hold; a place that nothing can be written to.
    pub fn create(
        path: &Path,
        format: AnimationFormat,
        settings: &AnimationSettings,
    ) -> Result<AnimationFile, SaveError> {
        let begin = || -> io::Result<(Box<dyn Encoder>, Spool)> {
            format.check_size((settings.width, settings.height)).map_err(invalid)?;
            format.check_rate(settings.fps).map_err(invalid)?;
            let encoder: Box<dyn Encoder> = match format {
                AnimationFormat::Gif => Box::new(gif::Gif::new(settings)?),
                AnimationFormat::Apng => Box::new(apng::Apng::new(settings)?),
                AnimationFormat::Webp => Box::new(webp::Webp::new(settings)?),
                AnimationFormat::Mp4 => Box::new(mp4::Mp4::new(settings)?),
                AnimationFormat::Html => Box::new(html::Html::new(path, settings)?),
            };
            Ok((encoder, Spool::beside(path, settings.overwrite)?))
        };
        let path = path.to_path_buf();
        match begin() {
            Ok((encoder, body)) => Ok(AnimationFile { path, settings: *settings, encoder, body, frames: 0 }),
            Err(cause) => Err(SaveError { path, cause }),
        }
    }

    /// Adds a frame: straight alpha, display values, row-major, row 0 on top.
    ///
    /// # Errors
    /// A frame of another size, what the format cannot hold, and a full disk.
    pub fn push(&mut self, rgba: &[[u8; 4]]) -> Result<(), SaveError> {
        let AnimationSettings { width, height, .. } = self.settings;
        let added = if rgba.len() as u64 == u64::from(width) * u64::from(height) {
            self.encoder.frame(rgba, &mut self.body)
        } else {
            Err(invalid(format!("a frame of {} pixels is not {width}x{height}", rgba.len())))
        };
        self.frames += 1;
        added.map_err(|cause| SaveError { path: self.path.clone(), cause })
    }

    /// Makes the file appear, whole.
    ///
    /// # Errors
    /// No frames; what the system said. There is no file then.
    pub fn finish(self) -> Result<(), SaveError> {
        let AnimationFile { path, settings, encoder, mut body, frames } = self;
        let publish = || {
            if frames == 0 {
                return Err(invalid("it has no frames".into()));
            }
            let head = encoder.finish(&mut body)?;
            body.publish(&head, &path, settings.overwrite)
        };
        publish().map_err(|cause| SaveError { path: path.clone(), cause })
    }
}

fn invalid(text: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, text)
}
