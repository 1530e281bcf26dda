//! The animation formats: detection by extension, limits and encoders.

use std::io;
use std::path::Path;

use super::apng::{self, Apng};
use super::encoder::{AnimationSettings, Encoder};
use super::gif::{self, Gif};
use super::html::Html;
use super::mp4::{self, Mp4};
use super::webp::{self, Webp};

/// Animation formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum AnimationFormat {
    /// 255 colours per frame, 1-bit alpha, at most 50 frames per second.
    Gif,
    /// Lossless, straight alpha.
    Apng,
    /// Lossy, or lossless at quality 100; straight alpha.
    Webp,
    /// H.264, 4:2:0, opaque, at most 3840x2160. Odd sides are extended by a pixel.
    Mp4,
    /// A self-contained page that turns the model by mouse, keys and touch; frames as in WebP. The URL fragment
    /// `#play` starts playback.
    Html,
}

/// The default quality of the lossy formats.
pub const ANIMATION_QUALITY: u8 = 90;

impl AnimationFormat {
    /// Checks that the format supports this frame rate.
    ///
    /// # Errors
    /// A message that says which rates it supports.
    pub fn check_rate(self, fps: f64) -> Result<(), String> {
        if !(fps.is_finite() && fps > 0.0) {
            return Err(format!("frames a second must be greater than zero, not {fps}"));
        }
        match self {
            AnimationFormat::Gif => gif::check_rate(fps),
            AnimationFormat::Apng => apng::check_rate(fps),
            AnimationFormat::Webp => webp::check_rate(fps),
            AnimationFormat::Mp4 => mp4::check_rate(fps),
            AnimationFormat::Html => Ok(()),
        }
    }

    /// Checks that the format supports frames of this size.
    ///
    /// # Errors
    /// A message that says which sizes it supports.
    pub fn check_size(self, size: (u32, u32)) -> Result<(), String> {
        if size.0 == 0 || size.1 == 0 {
            return Err("an animation has at least one pixel".into());
        }
        match self {
            AnimationFormat::Gif => gif::check_size(size),
            AnimationFormat::Apng => Ok(()),
            AnimationFormat::Webp | AnimationFormat::Html => webp::check_size(size),
            AnimationFormat::Mp4 => mp4::check_size(size),
        }
    }

    /// The format that the file extension of `path` stands for. A `.webp` may also be a still image.
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

    /// Returns true if [`AnimationSettings::quality`] applies.
    pub fn has_quality(self) -> bool {
        matches!(self, AnimationFormat::Webp | AnimationFormat::Mp4 | AnimationFormat::Html)
    }

    /// An encoder for a file at `path`.
    pub(super) fn encoder(self, path: &Path, settings: &AnimationSettings) -> io::Result<Box<dyn Encoder>> {
        Ok(match self {
            AnimationFormat::Gif => Box::new(Gif::new(settings)?),
            AnimationFormat::Apng => Box::new(Apng::new(settings)),
            AnimationFormat::Webp => Box::new(Webp::new(settings)),
            AnimationFormat::Mp4 => Box::new(Mp4::new(settings)?),
            AnimationFormat::Html => Box::new(Html::new(path, settings)),
        })
    }
}
