//! Reading regular files, of bytes that are bounded.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::import::error::LoadError;

/// Reads the scene's own file.
pub(crate) fn read_scene_file(path: &Path, limit: u64) -> Result<Vec<u8>, LoadError> {
    let metadata = std::fs::metadata(path).map_err(|e| LoadError::io(path, e))?;
    if metadata.is_file() {
        LoadError::check("file size in bytes", metadata.len(), limit)?;
    }
    read_limited(path, limit).and_then(no_pointer).map_err(|e| LoadError::io(path, e))
}

/// Opens the scene's own file, of which no more than `limit` bytes are read.
pub(crate) fn open_scene_file(path: &Path, limit: u64) -> Result<io::Take<File>, LoadError> {
    open_regular(path, limit).map(|file| file.take(limit)).map_err(|e| match std::fs::metadata(path) {
        Ok(file) if e.kind() == io::ErrorKind::FileTooLarge => {
            LoadError::Limit { name: "file size in bytes", asked: file.len(), allowed: limit }
        }
        _ => LoadError::io(path, e),
    })
}

/// Opens a regular file of at most `limit` bytes: no folders, pipes or devices, which may never
/// end.
///
/// # Errors
/// That it is none, that it is larger, or what the system says.
pub(crate) fn open_regular(path: &Path, limit: u64) -> io::Result<File> {
    // Looked at before it is opened: opening a pipe nobody writes to would wait for ever.
    let metadata = std::fs::metadata(path)?;
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
    let file = open_regular(path, limit)?;
    let mut bytes = Vec::with_capacity(file.metadata()?.len().min(limit) as usize);
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(too_large(limit)) } else { Ok(bytes) }
}

/// Refuses what stands for a file that lies elsewhere.
pub(crate) fn no_pointer(bytes: Vec<u8>) -> io::Result<Vec<u8>> {
    match crate::import::files::git_lfs::advice(&bytes) {
        Some(what) => Err(io::Error::new(io::ErrorKind::InvalidData, what)),
        None => Ok(bytes),
    }
}
