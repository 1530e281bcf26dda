//! Writes sheets.

use std::path::Path;

use anyhow::{Context, Result};

use blinn_output::{ImageFormat, Overwrite, write_atomically};

/// Encodes a sheet of `size` pixels, 8-bit sRGB with straight alpha, and writes it.
///
/// # Errors
/// The format does not hold the size, or the file cannot be written.
pub fn write_sheet(
    file: &Path,
    format: ImageFormat,
    size: (u32, u32),
    pixels: &[[u8; 4]],
    overwrite: Overwrite,
) -> Result<()> {
    let bytes = format.encode_rgba8(size, pixels)?;
    write_atomically(file, &bytes, overwrite).with_context(|| format!("{} cannot be written", file.display()))
}
