//! Pixels to bytes on disk, always whole: a file appears under its name complete, or not at all.

mod animation;
mod atomic;
mod cryptomatte;
mod exr;
mod jpeg;
mod metadata;
mod png;
mod preview;
mod thumbnail;
mod webp;
mod write_target;

use std::io;
use std::path::{Path, PathBuf};

use crate::display::Display;
use crate::integrator::Aov;
use crate::render::{AovLayer, Matte, PixelRect, Pixels};

pub use animation::{ANIMATION_QUALITY, AnimationFile, AnimationFormat, AnimationSettings};
pub use atomic::{Overwrite, block_writes, unnamed_temp_file, write_atomically, write_atomically_with};
pub use metadata::read_fingerprint;
pub use preview::{heat_color, heat_map_max, preview_layer, preview_matte, quantize_depth};
pub use thumbnail::encode_thumbnail;
pub use write_target::canonical_path;

/// The bytes of a PNG of straight 8-bit sRGB with alpha, row-major, row 0 on top.
///
/// # Errors
/// What the encoder says.
pub fn encode_png(size: (u32, u32), pixels: &[[u8; 4]]) -> io::Result<Vec<u8>> {
    png::encode8(size, pixels, None)
}

/// A picture ready to be written: colour, layers, and how it is shown.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Premultiplied linear colour.
    pub pixels: Pixels,
    /// Layers of the same size.
    pub layers: Vec<AovLayer>,
    /// Mattes of the same size.
    pub mattes: Vec<Matte>,
    /// How colour becomes display values, where the format holds those.
    pub display: Display,
    /// Where this is a part of a larger picture: that one.
    pub crop_window: Option<CropWindow>,
    /// Set where the picture of a depth layer is to be measured: metres to a step of 16 bits, in which 0
    /// is nothing at all. Otherwise it is a preview.
    pub depth_step: Option<f64>,
    /// A line of ASCII that its files keep, for [`read_fingerprint`] to find again.
    pub fingerprint: Option<String>,
}

/// Where a part lies in its picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CropWindow {
    /// What was rendered.
    pub crop: PixelRect,
    /// Columns of the whole picture.
    pub width: u32,
    /// Rows of the whole picture.
    pub height: u32,
}

impl Picture {
    /// A whole picture without layers.
    pub fn new(pixels: Pixels, display: Display) -> Picture {
        Picture {
            pixels,
            layers: Vec::new(),
            mattes: Vec::new(),
            display,
            crop_window: None,
            depth_step: None,
            fingerprint: None,
        }
    }
}

/// Bits a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BitDepth {
    /// What the format usually has: 8 in PNG, 32 in EXR.
    Default,
    /// 8 bits.
    Eight,
    /// 16: integers in PNG, halves in EXR.
    Sixteen,
}

/// File formats for single pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// Display-referred, straight alpha.
    Png,
    /// Linear, premultiplied alpha, layers in the same part.
    Exr,
    /// Display-referred, opaque, 8 bits, of a quality from 1 to 100.
    Jpeg(u8),
    /// Display-referred, straight alpha, 8 bits, without loss.
    Webp,
}

/// The quality of a JPEG where none is given.
pub const JPEG_QUALITY: u8 = 90;

impl ImageFormat {
    /// The endings of file names, as people are told them.
    pub const EXTENSIONS: &str = ".png, .exr, .jpg, .webp";

    /// By a file name's ending.
    pub fn from_path(path: &Path) -> Option<ImageFormat> {
        match path.extension()?.to_ascii_lowercase().to_str()? {
            "png" => Some(ImageFormat::Png),
            "exr" => Some(ImageFormat::Exr),
            "jpg" | "jpeg" => Some(ImageFormat::Jpeg(JPEG_QUALITY)),
            "webp" => Some(ImageFormat::Webp),
            _ => None,
        }
    }

    /// What a picture of it is called, and the bits a channel that it can have.
    pub fn bit_depths(self) -> (&'static str, &'static [(u8, BitDepth)]) {
        match self {
            ImageFormat::Png => ("a PNG", &[(8, BitDepth::Eight), (16, BitDepth::Sixteen)]),
            ImageFormat::Exr => ("an EXR", &[(16, BitDepth::Sixteen), (32, BitDepth::Default)]),
            ImageFormat::Jpeg(_) => ("a JPEG", &[(8, BitDepth::Eight)]),
            ImageFormat::Webp => ("a WebP", &[(8, BitDepth::Eight)]),
        }
    }

    /// Whether a picture may have so many columns and rows.
    ///
    /// # Errors
    /// How many it may have.
    pub fn check_size(self, (width, height): (u32, u32)) -> io::Result<()> {
        let (what, most) = match self {
            ImageFormat::Png | ImageFormat::Exr => return Ok(()),
            ImageFormat::Jpeg(_) => ("a JPEG", u32::from(u16::MAX)),
            ImageFormat::Webp => ("a WebP", 1 << 14),
        };
        if width <= most && height <= most {
            return Ok(());
        }
        let text = format!("{what} has at most {most} pixels a side, not {width}x{height}: write PNG or EXR");
        Err(io::Error::new(io::ErrorKind::InvalidInput, text))
    }

    /// The picture's bytes in this format.
    ///
    /// # Errors
    /// What the encoder says; sizes that the format cannot hold.
    pub fn encode(self, picture: &Picture, depth: BitDepth) -> io::Result<Vec<u8>> {
        let Picture { pixels, display, .. } = picture;
        let size = (pixels.width, pixels.height);
        let fingerprint = picture.fingerprint.as_deref();
        self.check_size(size)?;
        match self {
            ImageFormat::Png if depth == BitDepth::Sixteen => {
                png::encode16(size, &display.to_rgba16(pixels), fingerprint)
            }
            ImageFormat::Png => png::encode8(size, &display.to_rgba8(pixels), fingerprint),
            ImageFormat::Exr => exr::encode(picture, depth),
            ImageFormat::Jpeg(quality) => jpeg::encode(size, &display.to_rgba8(pixels), quality, fingerprint),
            ImageFormat::Webp => webp::encode(size, &display.to_rgba8(pixels), fingerprint),
        }
    }

    /// Whether layers are inside the picture, and not previews beside it.
    pub fn supports_layers(self) -> bool {
        self == ImageFormat::Exr
    }
}

/// The pixels without their alpha, where all of it is full.
fn opaque(pixels: &[[u8; 4]]) -> Option<Vec<u8>> {
    let full = pixels.iter().all(|p| p[3] == u8::MAX);
    full.then(|| pixels.iter().flat_map(|p| [p[0], p[1], p[2]]).collect())
}

/// Text as HTML, in quotes too.
pub fn escape_html(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Writes a picture, and previews `OUT.<aov>.png` of its layers beside formats that hold none.
/// Returns the files written.
///
/// # Errors
/// The file and what the system said of it.
pub fn save(
    picture: &Picture,
    path: &Path,
    format: ImageFormat,
    depth: BitDepth,
    replace: Overwrite,
) -> Result<Vec<PathBuf>, SaveError> {
    let failed = |path: &Path| {
        let path = path.to_path_buf();
        move |cause| SaveError { path, cause }
    };
    let names = picture.layers.iter().map(|layer| layer.aov.name().to_string());
    let names = names.chain(picture.mattes.iter().map(|matte| format!("cryptomatte-{}", matte.kind.name())));
    let beside = names.map(|name| path.with_extension(format!("{name}.png")));
    let beside: Vec<PathBuf> = if format.supports_layers() { Vec::new() } else { beside.collect() };
    // What stands in a layer's way is found before the picture is there.
    check_overwrite(path, replace)?;
    beside.iter().try_for_each(|file| check_overwrite(file, replace))?;
    let bytes = format.encode(picture, depth).map_err(failed(path))?;
    write_atomically(path, &bytes, replace).map_err(failed(path))?;
    let mut written = vec![path.to_path_buf()];
    if !format.supports_layers() {
        let size = (picture.pixels.width, picture.pixels.height);
        let fingerprint = picture.fingerprint.as_deref();
        let layers = picture.layers.iter().map(|layer| match (layer.aov, picture.depth_step) {
            (Aov::Depth, Some(step)) => png::encode_grey16(size, &quantize_depth(layer, step), fingerprint),
            // Who takes masks looks for one channel.
            (Aov::Mask, _) => png::encode_grey8(size, &preview_layer(layer), fingerprint),
            _ => png::encode8(size, &preview_layer(layer), fingerprint),
        });
        let mattes =
            picture.mattes.iter().map(|matte| png::encode8(size, &preview_matte(matte), fingerprint));
        for (file, bytes) in beside.into_iter().zip(layers.chain(mattes)) {
            let bytes = bytes.map_err(failed(&file))?;
            write_atomically(&file, &bytes, replace).map_err(failed(&file))?;
            written.push(file);
        }
    }
    Ok(written)
}

/// Whether a file may appear at `path`, by what is there now.
///
/// # Errors
/// That it is a folder, or exists where it must not be replaced.
pub fn check_overwrite(path: &Path, replace: Overwrite) -> Result<(), SaveError> {
    atomic::check_overwrite(path, replace).map_err(|cause| SaveError { path: path.to_path_buf(), cause })
}

/// Finds out whether `path` could be written, without writing it.
///
/// # Errors
/// As [`save`].
pub fn check_writable(path: &Path, replace: Overwrite) -> Result<(), SaveError> {
    atomic::check_writable(path, replace).map_err(|cause| SaveError { path: path.to_path_buf(), cause })
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
