//! Reads regular files up to a size limit.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::error::LoadError;
use crate::files::escape::printable;
use crate::files::git_lfs;
use crate::files::tar_archive::ArchivePath;

/// Name of the limit on a file's size.
pub(crate) const FILE_SIZE: &str = "file size in bytes";

/// Reads the scene's own file.
pub(crate) fn read_scene_file(path: &Path, limit: u64) -> Result<Vec<u8>, LoadError> {
    let metadata = std::fs::metadata(path).map_err(|e| LoadError::io(path, e))?;
    if metadata.is_file() {
        LoadError::check_limit(FILE_SIZE, metadata.len(), limit)?;
    }
    read_limited(path, limit).and_then(reject_lfs_pointer).map_err(|e| LoadError::io(path, e))
}

/// Opens a file of a scene, or of an archive that the path leads into, of at most `limit` bytes. A path with a slash at
/// the end is a folder, of which only the existence matters.
///
/// # Errors
/// The file cannot be opened, is a folder or a device, or has more bytes than `limit`.
pub fn open_input_file(path: &Path, limit: u64) -> io::Result<Box<dyn Read>> {
    let is_folder = path.as_os_str().as_encoded_bytes().ends_with(b"/");
    if let Some(inside) = ArchivePath::of(path) {
        let inside = inside?;
        if is_folder && inside.archive.has_folder(&inside.name) {
            return Ok(Box::new(io::empty()));
        }
        return Ok(Box::new(io::Cursor::new(inside.read(limit)?)));
    }
    if is_folder && path.is_dir() {
        return Ok(Box::new(io::empty()));
    }
    Ok(Box::new(open_regular_file(path, limit)?.take(limit)))
}

/// Opens the scene's own file for at most `limit` bytes.
pub fn open_scene_file(path: &Path, limit: u64) -> Result<io::Take<File>, LoadError> {
    open_regular_file(path, limit).map(|file| file.take(limit)).map_err(|e| match std::fs::metadata(path) {
        Ok(file) if e.kind() == io::ErrorKind::FileTooLarge => {
            LoadError::Limit { name: FILE_SIZE, requested: file.len(), allowed: limit }
        }
        _ if e.kind() == io::ErrorKind::IsADirectory => {
            LoadError::io(path, io::Error::new(e.kind(), folder_hint(path)))
        }
        _ => LoadError::io(path, e),
    })
}

/// Number of scene files that the message about a folder names.
const NAMED_SCENES: usize = 4;

/// Explains what to type instead of a folder.
fn folder_hint(folder: &Path) -> String {
    let entries = |folder: &Path| -> Vec<PathBuf> {
        std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
    };
    let is_scene = |path: &PathBuf| {
        let extension = path.extension().map(|e| e.to_ascii_lowercase()).unwrap_or_default();
        crate::SCENE_EXTENSIONS.iter().chain(&["blend"]).any(|scene| extension == *scene)
    };
    let direct = entries(folder);
    let mut scenes: Vec<PathBuf> = direct.iter().filter(|path| is_scene(path)).cloned().collect();
    if scenes.is_empty() {
        scenes = direct.iter().flat_map(|inner| entries(inner)).filter(is_scene).collect();
    }
    scenes.sort();
    let names = scenes.iter().take(NAMED_SCENES).map(|path| printable(&path.to_string_lossy()));
    let names = names.collect::<Vec<_>>().join(" or ");
    match scenes.len() {
        0 => "a folder without .gltf, .glb, .obj, .stl, .ply or .blend files; name a scene file".to_string(),
        1 => format!("a folder; name the scene in it: {names}"),
        count if count <= NAMED_SCENES => format!("a folder; name a scene in it: {names}"),
        count => format!("a folder; name a scene in it, such as {names} ({count} scenes)"),
    }
}

/// Opens a regular file of at most `limit` bytes. Folders, pipes and devices, which may never end, are
/// errors.
///
/// # Errors
/// The path is no regular file, the file is larger than `limit`, or the operating system fails to open it.
pub(crate) fn open_regular_file(path: &Path, limit: u64) -> io::Result<File> {
    // Checked before opening: opening a pipe without a writer blocks.
    let metadata = std::fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "a folder, not a file"));
    }
    if !metadata.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    if metadata.len() > limit { Err(too_large(limit)) } else { File::open(path) }
}

fn too_large(limit: u64) -> io::Error {
    io::Error::new(io::ErrorKind::FileTooLarge, format!("larger than the limit of {limit} bytes"))
}

/// Reads a regular file of at most `limit` bytes.
pub(crate) fn read_limited(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = open_regular_file(path, limit)?;
    let mut bytes = Vec::with_capacity(file.metadata()?.len().min(limit) as usize);
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(too_large(limit)) } else { Ok(bytes) }
}

/// Fails if the content is a Git LFS pointer instead of the file itself.
pub(crate) fn reject_lfs_pointer(bytes: Vec<u8>) -> io::Result<Vec<u8>> {
    match git_lfs::pointer_hint(&bytes) {
        Some(hint) => Err(io::Error::new(io::ErrorKind::InvalidData, hint)),
        None => Ok(bytes),
    }
}
