//! Importers: glTF, GLB, OBJ, STL and PLY files to a [`Scene`], Radiance HDR and OpenEXR environment maps, and camera
//! XML.
//!
//! Files are untrusted. Sizes are checked before memory is allocated, indices before they are used, and
//! references stay inside the scene's folder unless [`LoadOptions::allow_outside`] is set. Harmless defects
//! are repaired and reported as [`Warning`]s.
#![deny(unsafe_code)]
#![warn(missing_docs)]

mod bodies;
mod camera_xml;
mod cameras;
mod compact;
mod error;
mod files;
mod finite_uvs;
mod flat;
mod gltf;
mod heights;
mod ies;
pub mod image;
mod memory;
mod memory_watch;
mod missing_uvs;
mod normal_maps;
mod obj;
mod options;
mod ply;
mod polygons;
mod scale;
mod smooth;
mod stl;
mod tangents;
mod unlit_rounds;

use std::io::{self, Read};
use std::path::Path;

use blinn_core::worded;
use blinn_scene::{FileDigest, Scene, SourceFormat};
use files::scene_input::SceneInput;
use files::tar_archive::ArchivePath;
use memory::MemoryBudget;

pub use bodies::refracts_if_closed;
pub use camera_xml::load_camera_xml;
pub use cameras::{CameraFile, Lens, ListedCamera, MAX_CAMERAS, RecordedView};
pub use error::{LoadError, Warning};
pub use files::foreign_format::is_foreign_model;
pub use files::limits::Limits;
pub use files::read_file::{open_input_file, open_scene_file};
pub use files::tar_archive::{file_version, has_tar_extension, is_in_archive, scenes_in_tar};
pub use image::environment::load_environment;
pub use image::stored_frames::{StoredFrame, StoredFrames};
pub use image::stored_picture::{PictureChannel, PictureEncoding, StoredPicture};
pub use memory_watch::MemoryWatch;
pub use options::{BakeMode, GlassMode, LoadOptions, MtlColors, SceneChoice};
pub use smooth::NormalMode;

/// Extensions of scene files, in lower case.
pub const SCENE_EXTENSIONS: [&str; 5] = ["gltf", "glb", "obj", "stl", "ply"];

/// Bytes at the start of a file that its format is detected from.
const HEAD_BYTES: u64 = 4096;

/// Loads a scene with all warnings. The format (glTF, GLB, OBJ, STL or PLY) is detected from the content, then from the
/// extension, unless [`LoadOptions::format`] is set. A path such as `objects.tar/a/chair.obj` names a file in a tar file,
/// which is read in place with the files beside it.
///
/// # Errors
/// The file cannot be read, is malformed, exceeds a limit or needs an unsupported feature. The error has the
/// location in the file.
pub fn load(path: &Path, options: &LoadOptions) -> Result<(Scene, Vec<Warning>), LoadError> {
    if let Some(inside) = ArchivePath::of(path) {
        let limit = options.limits.file_bytes;
        let inside = inside.map_err(|e| LoadError::io(path, e))?;
        if let Some((_, bytes)) = inside.archive.place(&inside.name) {
            LoadError::check_limit(files::read_file::FILE_SIZE, bytes, limit)?;
        }
        let bytes = inside.read(limit).map_err(|e| LoadError::io(path, e))?;
        return load_input(SceneInput::Memory(&bytes), path, options);
    }
    load_input(SceneInput::File(path), path, options)
}

/// Loads a scene from memory, as [`load`] does. `path` names the scene, and its folder has the files that the scene
/// refers to. The path itself need not exist.
///
/// # Errors
/// As for [`load`].
pub fn load_bytes(
    bytes: &[u8],
    path: &Path,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    load_input(SceneInput::Memory(bytes), path, options)
}

fn load_input(
    input: SceneInput,
    path: &Path,
    options: &LoadOptions,
) -> Result<(Scene, Vec<Warning>), LoadError> {
    let limit = options.limits.file_bytes;
    let mut head = Vec::new();
    let (file, length) = input.open(limit)?;
    file.take(HEAD_BYTES).read_to_end(&mut head).map_err(|e| LoadError::io(path, e))?;
    if let Some(hint) = files::git_lfs::pointer_hint(&head) {
        return Err(LoadError::io(path, io::Error::new(io::ErrorKind::InvalidData, hint)));
    }
    if options.format.is_none()
        && let Some(hint) = files::foreign_format::hint(path, &head)
    {
        return Err(LoadError::Unsupported(hint));
    }
    let folder =
        files::scene_folder::SceneFolder::of(path, options.allow_outside).with_cancel(&options.cancel);
    let format = match options.format {
        Some(format) => format,
        None => detect_format(path, &head, length)?,
    };
    let (mut scene, mut warnings) = match format {
        SourceFormat::Gltf => {
            let bytes = input.read(limit)?;
            folder.sources.record_scene(FileDigest::of(&bytes));
            gltf::load(&bytes, &folder, options)?
        }
        format => {
            if let Some(name) = options.variant.as_deref().filter(|name| *name != "none") {
                return Err(gltf::unknown_variant(name, &[]));
            }
            if format == SourceFormat::Obj {
                obj::load(input, &folder, options)?
            } else {
                let bytes = input.read(limit)?;
                folder.sources.record_scene(FileDigest::of(&bytes));
                let load = if format == SourceFormat::Ply { ply::load } else { stl::load };
                load(&bytes, &folder, options)?
            }
        }
    };
    options.cancel.check()?;
    scale::scale_lengths(&mut scene, options.scale.unwrap_or(1.0));
    warnings.extend(missing_uvs::warnings(&scene));
    warnings.extend(missing_uvs::anisotropy_warnings(&scene));
    scene.name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    (scene.source.digest, scene.source.files) = folder.sources.into_contents();
    // Blender filters encoded texels and decodes sRGB afterwards; its files are rendered likewise.
    let is_blender = scene.source.is_blender();
    scene.textures.iter_mut().for_each(|t| t.decode_last = is_blender);
    bodies::mark_bodies(&mut scene, options.glass);
    options.cancel.check()?;
    if options.normals.generates() {
        MemoryBudget::charge_normals(options, &scene)?;
    }
    smooth::apply(&mut scene, options.normals, &options.cancel)?;
    Ok((scene, warnings))
}

/// Detects the format by the content: GLB's magic number, JSON's first brace, the first line of PLY, the size of binary STL or
/// the first words of STL; else by the extension. OBJ has no mark, but statements.
///
/// # Errors
/// The file has neither a known extension nor the content of a scene.
fn detect_format(path: &Path, head: &[u8], bytes: u64) -> Result<SourceFormat, LoadError> {
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head);
    let first = text.iter().copied().find(|b| !b.is_ascii_whitespace());
    if head.starts_with(b"glTF") || first == Some(b'{') {
        return Ok(SourceFormat::Gltf);
    }
    if ply::is_ply(head) {
        return Ok(SourceFormat::Ply);
    }
    if stl::is_stl(head, bytes) {
        return Ok(SourceFormat::Stl);
    }
    match path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase()).as_deref() {
        Some("gltf" | "glb") => Ok(SourceFormat::Gltf),
        Some("ply") => Ok(SourceFormat::Ply),
        Some("stl") => Ok(SourceFormat::Stl),
        Some("obj") => Ok(SourceFormat::Obj),
        _ if obj::may_be_obj(head) => Ok(SourceFormat::Obj),
        _ => Err(LoadError::Unsupported(worded!(
            "the file is in no format that blinn recognizes; use a .gltf, .glb, .obj, .stl or .ply file, or name its \
             format with `format`"
        ))),
    }
}
