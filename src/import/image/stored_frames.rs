//! The frames of animated pictures, one at a time.

use std::io::{BufReader, Cursor};
use std::path::Path;
use std::time::Duration;

use image::codecs::gif::GifDecoder;
use image::codecs::png::PngDecoder;
use image::codecs::webp::WebPDecoder;
use image::{AnimationDecoder, Frame, Frames, ImageFormat, ImageResult};

use super::size;
use super::stored_picture::{PictureChannel, PictureEncoding, StoredPicture};
use crate::Limits;
use crate::error::LoadError;
use crate::files::read_file::read_scene_file;
use crate::memory::MemoryBudget;

/// Bytes in memory for each pixel: values of four channels, and what a decoder keeps.
const PIXEL_BYTES: u64 = 64;

/// A frame of an animated picture, complete.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredFrame {
    /// The picture.
    pub picture: StoredPicture,
    /// The time for which it is shown; 0 for a still picture.
    pub delay: Duration,
}

/// The frames of an animated picture.
pub struct StoredFrames {
    /// The file, for errors.
    place: String,
    source: FrameSource,
}

enum FrameSource {
    Still(Option<StoredPicture>),
    /// The frames that were read to find out that there are several, and the decoder.
    Decoder(std::vec::IntoIter<Frame>, Frames<'static>),
}

impl StoredFrames {
    /// Opens an animated GIF, PNG or WebP picture. `None` for other files, and for a single frame.
    ///
    /// # Errors
    /// The file cannot be read, one of its first frames is damaged, or exceeds a limit.
    pub fn open(path: &Path, limits: &Limits) -> Result<Option<StoredFrames>, LoadError> {
        let bytes = read_scene_file(path, limits.file_bytes.min(limits.memory_bytes))?;
        let Some(format) = image::guess_format(&bytes).ok().filter(|format| is_animatable(*format)) else {
            return Ok(None);
        };
        let budget = MemoryBudget::new(limits);
        budget.charge(bytes.len() as u64)?;
        let damaged = |cause: &str| damaged(&path.display().to_string(), cause);
        let (width, height) = size(&bytes).map_err(|cause| damaged(&cause))?;
        let pixels = u64::from(width) * u64::from(height);
        LoadError::check_limit("pixels of a picture", pixels, limits.image_pixels)?;
        budget.charge(pixels.saturating_mul(PIXEL_BYTES))?;
        let Some(mut frames) = frames(bytes, format).map_err(|e| damaged(&e.to_string()))? else {
            return Ok(None);
        };
        let mut first = Vec::new();
        for frame in frames.by_ref().take(2) {
            first.push(frame.map_err(|e| damaged(&e.to_string()))?);
        }
        let source = FrameSource::Decoder(first.into_iter(), frames);
        let is_animated = matches!(&source, FrameSource::Decoder(first, _) if first.len() == 2);
        Ok(is_animated.then(|| StoredFrames { place: path.display().to_string(), source }))
    }

    /// The one frame of a still picture.
    pub fn still(picture: StoredPicture) -> StoredFrames {
        StoredFrames { place: String::new(), source: FrameSource::Still(Some(picture)) }
    }
}

impl Iterator for StoredFrames {
    type Item = Result<StoredFrame, LoadError>;

    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.source {
            FrameSource::Still(picture) => {
                Some(Ok(StoredFrame { picture: picture.take()?, delay: Duration::ZERO }))
            }
            FrameSource::Decoder(first, frames) => {
                let frame = first.next().map(Ok).or_else(|| frames.next())?;
                Some(frame.map(stored_frame).map_err(|e| damaged(&self.place, &e.to_string())))
            }
        }
    }
}

fn damaged(place: &str, cause: &str) -> LoadError {
    let cause = cause.split_whitespace().collect::<Vec<_>>().join(" ");
    LoadError::parse(place, format!("the picture cannot be decoded: {cause}"))
}

fn is_animatable(format: ImageFormat) -> bool {
    matches!(format, ImageFormat::Gif | ImageFormat::Png | ImageFormat::WebP)
}

/// The decoder of an animation; `None` for a still picture.
fn frames(bytes: Vec<u8>, format: ImageFormat) -> ImageResult<Option<Frames<'static>>> {
    let reader = BufReader::new(Cursor::new(bytes));
    Ok(match format {
        ImageFormat::Gif => Some(GifDecoder::new(reader)?.into_frames()),
        ImageFormat::Png => {
            let decoder = PngDecoder::new(reader)?;
            if decoder.is_apng()? { Some(decoder.apng()?.into_frames()) } else { None }
        }
        ImageFormat::WebP => {
            let decoder = WebPDecoder::new(reader)?;
            if decoder.has_animation() { Some(decoder.into_frames()) } else { None }
        }
        _ => None,
    })
}

fn stored_frame(frame: Frame) -> StoredFrame {
    let delay = Duration::from(frame.delay());
    let pixels = frame.into_buffer();
    let channel = |(i, name): (usize, &&str)| PictureChannel {
        name: name.to_string(),
        values: pixels.pixels().map(|pixel| f64::from(f32::from(pixel.0[i]) / 255.0)).collect(),
    };
    let channels = ["R", "G", "B", "A"].iter().enumerate().map(channel).collect();
    let (width, height) = pixels.dimensions();
    let picture = StoredPicture { width, height, encoding: PictureEncoding::Display, channels };
    StoredFrame { picture, delay }
}
