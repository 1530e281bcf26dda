//! The still image formats: detection by extension, limits and encoding.

use std::io;
use std::path::Path;

use super::display_colors::DisplayColors;
use super::picture::Picture;
use super::{exr, jpeg, png, webp};

/// Bits per channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum BitDepth {
    /// The usual depth of the format: 8 in PNG, 32 in EXR.
    Default,
    /// 8-bit integers.
    Eight,
    /// 16-bit integers in PNG, half floats in EXR.
    Sixteen,
}

/// Still image formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum ImageFormat {
    /// Display-referred, straight alpha.
    Png,
    /// Linear, premultiplied alpha, with the layers in the same part.
    Exr,
    /// Display-referred, opaque, 8 bits, with a quality from 1 to 100.
    Jpeg(u8),
    /// Display-referred, straight alpha, 8 bits, lossless.
    Webp,
}

/// The default quality of JPEG.
pub const JPEG_QUALITY: u8 = 90;

impl ImageFormat {
    /// The file extensions, for messages.
    pub const EXTENSIONS: &str = ".png, .exr, .jpg, .webp";

    /// The format that the file extension of `path` stands for.
    pub fn from_path(path: &Path) -> Option<ImageFormat> {
        match path.extension()?.to_ascii_lowercase().to_str()? {
            "png" => Some(ImageFormat::Png),
            "exr" => Some(ImageFormat::Exr),
            "jpg" | "jpeg" => Some(ImageFormat::Jpeg(JPEG_QUALITY)),
            "webp" => Some(ImageFormat::Webp),
            _ => None,
        }
    }

    /// The name of the format, and the bits per channel that it supports.
    pub fn bit_depths(self) -> (&'static str, &'static [(u8, BitDepth)]) {
        match self {
            ImageFormat::Png => ("PNG", &[(8, BitDepth::Eight), (16, BitDepth::Sixteen)]),
            ImageFormat::Exr => ("EXR", &[(16, BitDepth::Sixteen), (32, BitDepth::Default)]),
            ImageFormat::Jpeg(_) => ("JPEG", &[(8, BitDepth::Eight)]),
            ImageFormat::Webp => ("WebP", &[(8, BitDepth::Eight)]),
        }
    }

    /// Checks that the format supports images of this size.
    ///
    /// # Errors
    /// The size is larger than the format's limit.
    pub fn check_size(self, (width, height): (u32, u32)) -> io::Result<()> {
        let (name, max) = match self {
            ImageFormat::Png | ImageFormat::Exr => return Ok(()),
            ImageFormat::Jpeg(_) => ("JPEG", u32::from(u16::MAX)),
            ImageFormat::Webp => ("WebP", 1 << 14),
        };
        if width <= max && height <= max {
            return Ok(());
        }
        let message =
            format!("{name} has at most {max} pixels a side, not {width}x{height}; write PNG or EXR");
        Err(io::Error::new(io::ErrorKind::InvalidInput, message))
    }

    /// Encodes the image.
    ///
    /// # Errors
    /// The encoder fails, or the image is larger than the format's limit.
    pub fn encode(self, picture: &Picture, depth: BitDepth) -> io::Result<Vec<u8>> {
        let Picture { pixels, display, .. } = picture;
        let size = picture.size();
        let fingerprint = picture.fingerprint.as_deref();
        self.check_size(size)?;
        match self {
            ImageFormat::Png if depth == BitDepth::Sixteen => {
                png::encode_rgba16(size, &display.to_rgba16(pixels), fingerprint)
            }
            ImageFormat::Png => png::encode_colors(size, &DisplayColors::of(picture), fingerprint),
            ImageFormat::Exr => exr::encode(picture, depth == BitDepth::Sixteen),
            ImageFormat::Jpeg(quality) => {
                jpeg::encode(size, &DisplayColors::of(picture), quality, fingerprint)
            }
            ImageFormat::Webp => webp::encode(size, &DisplayColors::of(picture), fingerprint),
        }
    }

    /// Encodes 8-bit sRGB pixels with straight alpha, row-major, row 0 on top.
    ///
    /// # Errors
    /// As for [`ImageFormat::encode`]; EXR, which stores linear light.
    pub fn encode_rgba8(self, size: (u32, u32), pixels: &[[u8; 4]]) -> io::Result<Vec<u8>> {
        self.check_size(size)?;
        match self {
            ImageFormat::Png => png::encode_colors(size, &pixels.into(), None),
            ImageFormat::Jpeg(quality) => jpeg::encode(size, &pixels.into(), quality, None),
            ImageFormat::Webp => webp::encode(size, &pixels.into(), None),
            ImageFormat::Exr => {
                let message = "EXR stores linear light, not display values; write PNG, JPEG or WebP";
                Err(io::Error::new(io::ErrorKind::InvalidInput, message))
            }
        }
    }

    /// Upper estimate of the bytes per pixel that encoding takes beside the picture: display colours, what the encoder
    /// keeps, and the file. Layers in the file are left out.
    pub fn encoding_bytes(self, depth: BitDepth) -> u64 {
        match self {
            // Linear light is encoded as it is.
            ImageFormat::Exr => 20,
            ImageFormat::Png if depth == BitDepth::Sixteen => 28,
            ImageFormat::Png => 9,
            ImageFormat::Jpeg(_) => 12,
            ImageFormat::Webp => 40,
        }
    }

    /// Returns true if the image file holds the layers. Otherwise they are written to files beside it.
    pub fn supports_layers(self) -> bool {
        self == ImageFormat::Exr
    }
}
