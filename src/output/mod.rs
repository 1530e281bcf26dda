//! Pixels to bytes on disk, always whole: a file appears under its name complete, or not at all.

mod atomic;
mod cryptomatte;
mod exr;
mod png;
mod preview;

use std::io;
use std::path::{Path, PathBuf};

use crate::display::Display;
use crate::render::{Crop, Layer, Matte, Pixels};

pub use atomic::{Replace, hold_writes, write_atomically};
pub use preview::preview;

/// A picture ready to be written: colour, layers, and how it is shown.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Premultiplied linear colour.
    pub pixels: Pixels,
    /// Layers of the same size.
    pub layers: Vec<Layer>,
    /// Mattes of the same size.
    pub mattes: Vec<Matte>,
    /// How colour becomes display values, where the format holds those.
    pub display: Display,
    /// Where this is a part of a larger picture: that one.
    pub part: Option<Part>,
}

/// Where a part lies in its picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// What was rendered.
    pub crop: Crop,
    /// Columns of the whole picture.
    pub width: u32,
    /// Rows of the whole picture.
    pub height: u32,
}

impl Picture {
    /// A whole picture without layers.
    pub fn new(pixels: Pixels, display: Display) -> Picture {
        Picture { pixels, layers: Vec::new(), mattes: Vec::new(), display, part: None }
    }
}

/// Bits a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// What the format usually has: 8 in PNG, 32 in EXR.
    Usual,
    /// 8 bits.
    Eight,
    /// 16: integers in PNG, halves in EXR.
    Sixteen,
}

/// File formats for single pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Display-referred, straight alpha.
    Png,
    /// Linear, premultiplied alpha, layers in the same part.
    Exr,
}

impl Format {
    /// By a file name's ending.
    pub fn of(path: &Path) -> Option<Format> {
        match path.extension()?.to_ascii_lowercase().to_str()? {
            "png" => Some(Format::Png),
            "exr" => Some(Format::Exr),
            _ => None,
        }
    }

    /// The picture's bytes in this format.
    ///
    /// # Errors
    /// What the encoder says; sizes that the format cannot hold.
    pub fn encode(self, picture: &Picture, depth: Depth) -> io::Result<Vec<u8>> {
        match self {
            Format::Png if depth == Depth::Sixteen => png::encode16(
                picture.pixels.width,
                picture.pixels.height,
                &picture.display.to_rgba16(&picture.pixels),
            ),
            Format::Png => png::encode8(
                picture.pixels.width,
                picture.pixels.height,
                &picture.display.to_rgba8(&picture.pixels),
            ),
            Format::Exr => exr::encode(picture, depth),
        }
    }
}

/// Writes a picture, and beside a PNG a preview `OUT.<aov>.png` of each layer. Returns the files
/// written.
///
/// # Errors
/// The file and what the system said of it.
pub fn save(
    picture: &Picture,
    path: &Path,
    format: Format,
    depth: Depth,
    replace: Replace,
) -> Result<Vec<PathBuf>, SaveError> {
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        move |cause| SaveError { path, cause }
    };
    let bytes = format.encode(picture, depth).map_err(failed(path))?;
    write_atomically(path, &bytes, replace).map_err(failed(path))?;
    let mut written = vec![path.to_path_buf()];
    if format == Format::Png {
        for layer in &picture.layers {
            let beside = path.with_extension(format!("{}.png", layer.aov.name()));
            let image = preview(layer);
            let bytes =
                png::encode8(picture.pixels.width, picture.pixels.height, &image).map_err(failed(&beside))?;
            write_atomically(&beside, &bytes, replace).map_err(failed(&beside))?;
            written.push(beside);
        }
    }
    Ok(written)
}

/// A picture that could not be written. There is no part of it on disk.
#[derive(Debug, thiserror::Error)]
#[error("{} cannot be written: {cause}", .path.display())]
pub struct SaveError {
    /// Which file.
    pub path: PathBuf,
    /// What the system said.
    pub cause: io::Error,
}
