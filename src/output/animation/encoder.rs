//! The interface of the animation encoders.

use std::io;

use crate::atomic::Overwrite;

use super::spool::Spool;

/// Settings of an animation file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnimationSettings {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Frames per second.
    pub fps: f64,
    /// Loops forever; otherwise it plays once and stops at the last frame.
    pub repeat: bool,
    /// Quality from 1 to 100 of the lossy formats.
    pub quality: u8,
    /// Handling of an existing file at the output path.
    pub overwrite: Overwrite,
    /// The model turns clockwise as seen from above. A drag on an HTML page follows it.
    pub clockwise: bool,
}

/// Encodes frames to the body of a file. The head often holds what is known only after the last frame.
pub(super) trait Encoder: Send {
    /// Encodes a frame of `width` × `height` pixels, straight alpha.
    fn frame(&mut self, pixels: &[[u8; 4]], body: &mut Spool) -> io::Result<()>;

    /// Completes the body, and returns the head, which precedes it in the file.
    fn finish(self: Box<Self>, body: &mut Spool) -> io::Result<Vec<u8>>;
}

/// An error about invalid input.
pub(super) fn invalid_input(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, message)
}
