//! Writes an image and the previews of its layers.

use std::io;
use std::path::{Path, PathBuf};

use glam::Vec4;

use super::atomic::{self, Overwrite, write_atomically};
use super::format::{BitDepth, ImageFormat};
use super::id_image;
use super::layer_folder::LayerFolder;
use super::picture::Picture;
use super::png;
use super::preview::{preview_layer, preview_matte, quantize_depth};
use blinn_render::integrator::Aov;
use blinn_render::{AovLayer, Pixels};

/// Writes an image. Formats that hold no layers get a preview `OUT.<aov>.png` for each layer.
/// Returns the paths of the written files.
///
/// # Errors
/// A file cannot be written. All paths are checked before the first file is written.
pub fn save(
    picture: &Picture,
    path: &Path,
    format: ImageFormat,
    depth: BitDepth,
    overwrite: Overwrite,
) -> Result<Vec<PathBuf>, SaveError> {
    save_with_layers(picture, path, LayerFolder::Beside, format, depth, overwrite)
}

/// [`save`] with the previews of layers in a folder, which exists.
///
/// # Errors
/// As [`save`].
pub fn save_with_layers(
    picture: &Picture,
    path: &Path,
    layers: LayerFolder,
    format: ImageFormat,
    depth: BitDepth,
    overwrite: Overwrite,
) -> Result<Vec<PathBuf>, SaveError> {
    let previews = preview_paths(picture, path, layers, format);
    check_overwrite(path, overwrite)?;
    previews.iter().try_for_each(|file| check_overwrite(file, overwrite))?;
    encode_files(picture, path, layers, format, depth)
        .map(|file| {
            let EncodedFile { path, bytes } = file?;
            write_atomically(&path, &bytes, overwrite).map_err(|e| SaveError::new(&path, e))?;
            Ok(path)
        })
        .collect()
}

/// A file in memory.
#[derive(Clone, Debug)]
pub struct EncodedFile {
    /// Its path.
    pub path: PathBuf,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// Encodes the files that [`save_with_layers`] writes, one after the other: the image, then the previews of its layers.
pub fn encode_files<'p>(
    picture: &'p Picture,
    path: &'p Path,
    layers: LayerFolder,
    format: ImageFormat,
    depth: BitDepth,
) -> impl Iterator<Item = Result<EncodedFile, SaveError>> + 'p {
    let image = std::iter::once_with(move || (path.to_path_buf(), format.encode(picture, depth)));
    let encoded = picture.layers.iter().map(|layer| encode_layer(picture, layer));
    let mattes = picture.mattes.iter().map(|matte| {
        let colors = preview_matte(matte);
        png::encode_colors(picture.size(), &colors[..].into(), picture.fingerprint.as_deref())
    });
    let previews = preview_paths(picture, path, layers, format).into_iter().zip(encoded.chain(mattes));
    image.chain(previews).map(|(path, bytes)| match bytes {
        Ok(bytes) => Ok(EncodedFile { path, bytes }),
        Err(cause) => Err(SaveError { path, cause }),
    })
}

/// The files of the layers, then of the mattes. None for formats that hold layers.
fn preview_paths(picture: &Picture, path: &Path, folder: LayerFolder, format: ImageFormat) -> Vec<PathBuf> {
    if format.supports_layers() {
        return Vec::new();
    }
    let layers = picture.layers.iter().map(|layer| layer.aov.name().to_string());
    let mattes = picture.mattes.iter().map(|matte| format!("cryptomatte-{}", matte.kind.name()));
    layers.chain(mattes).map(|name| folder.file(path, &name)).collect()
}

fn encode_layer(picture: &Picture, layer: &AovLayer) -> io::Result<Vec<u8>> {
    let size = picture.size();
    let fingerprint = picture.fingerprint.as_deref();
    if let Some(names) = picture.id_names.of(layer.aov)
        && let Some(ids) = id_image::encode(size, layer, names, fingerprint)
    {
        return ids;
    }
    match (layer.aov, picture.depth_step) {
        (Aov::Depth, Some(step)) => png::encode_grey16(size, &quantize_depth(layer, step), fingerprint),
        // As the picture is shown.
        (aov, _) if aov.light().is_some() => {
            let colors = layer.values.chunks_exact(3).map(|v| Vec4::new(v[0], v[1], v[2], 1.0)).collect();
            let (width, height) = size;
            let pixels = Pixels { width, height, colors };
            png::encode_colors(size, &picture.display.to_rgba8(&pixels)[..].into(), fingerprint)
        }
        // Programs that read masks expect a single channel.
        (Aov::Mask, _) => png::encode_grey8(size, &preview_layer(layer), fingerprint),
        _ => png::encode_colors(size, &preview_layer(layer)[..].into(), fingerprint),
    }
}

/// Checks, without touching the disk, that a file may be created at `path`.
///
/// # Errors
/// `path` is a folder, or exists and must not be overwritten.
pub fn check_overwrite(path: &Path, overwrite: Overwrite) -> Result<(), SaveError> {
    atomic::check_overwrite(path, overwrite).map_err(|e| SaveError::new(path, e))
}

/// Checks that a file can be created at `path`, without creating it.
///
/// # Errors
/// As [`save`].
pub fn check_writable(path: &Path, overwrite: Overwrite) -> Result<(), SaveError> {
    atomic::check_writable(path, overwrite).map_err(|e| SaveError::new(path, e))
}

/// A file that could not be written. Nothing of it is on disk.
#[derive(Debug, thiserror::Error)]
#[error("{} cannot be written: {cause}", .path.display())]
pub struct SaveError {
    /// The file.
    pub path: PathBuf,
    /// The system's or encoder's error.
    pub cause: io::Error,
}

impl SaveError {
    pub(super) fn new(path: &Path, cause: io::Error) -> SaveError {
        SaveError { path: path.to_path_buf(), cause }
    }
}
