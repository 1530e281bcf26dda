//! Whole files or none.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{RwLock, RwLockWriteGuard};

/// Read by whoever writes a file, written by whoever must not find one half-written.
static WRITING: RwLock<()> = RwLock::new(());

/// Waits until no file is being written, and keeps it so while the guard lives. A process that
/// ends meanwhile leaves nothing partial.
pub fn hold_writes() -> RwLockWriteGuard<'static, ()> {
    WRITING.write().unwrap_or_else(|e| e.into_inner())
}

/// What becomes of a file that is there already.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Replace {
    /// The new file takes its place once it is complete.
    #[default]
    Yes,
    /// It stays, and writing fails.
    No,
}

/// Writes `bytes` under a passing name beside `path`, and moves them there when they are all on
/// disk. On any error, and when the process is stopped in order, nothing is left behind.
///
/// # Errors
/// What the system said, or that the file exists where it must not be replaced.
pub fn write_atomically(path: &Path, bytes: &[u8], replace: Replace) -> io::Result<()> {
    write_whole(path, replace, |file| file.write_all(bytes))
}

/// As [`write_atomically`], of what `write` puts into the file.
pub(super) fn write_whole(
    path: &Path,
    replace: Replace,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    may_write(path, replace)?;
    let _writing = WRITING.read().unwrap_or_else(|e| e.into_inner());
    let mut builder = tempfile::Builder::new();
    builder.prefix(".blinn-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any program's files: the umask takes away what it must.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder(path)).map_err(without_path)?;
    write(file.as_file_mut())?;
    file.as_file().sync_data()?;
    match replace {
        Replace::Yes => file.persist(path),
        Replace::No => file.persist_noclobber(path),
    }
    .map(drop)
    .map_err(|e| e.error)
}

/// A file without a name, on the disk that `path` is on: it is gone when the process is, however that ends.
pub(super) fn nameless_beside(path: &Path) -> io::Result<File> {
    tempfile::tempfile_in(folder(path)).map_err(without_path)
}

/// Tries whether a file could be written at `path`. No file is seen there meanwhile.
pub(super) fn try_to_write(path: &Path, replace: Replace) -> io::Result<()> {
    may_write(path, replace)?;
    tempfile::tempfile_in(folder(path)).map(drop).map_err(without_path)
}

/// Whether a file may appear at `path`.
pub(super) fn may_write(path: &Path, replace: Replace) -> io::Result<()> {
    if replace == Replace::No && path.exists() {
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, "it exists, and --no-overwrite was given"));
    }
    if path.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
    }
    Ok(())
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The system's own words: the passing name, which tempfile adds, means nothing to anyone.
fn without_path(error: io::Error) -> io::Error {
    let text = error.to_string();
    io::Error::new(error.kind(), text.split(" at path").next().unwrap_or(&text).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_or_kept() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        write_atomically(&path, b"one", Replace::Yes).unwrap();
        write_atomically(&path, b"two", Replace::Yes).unwrap();
        assert!(write_atomically(&path, b"three", Replace::No).is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn nothing_is_left_where_nothing_can_be_written() {
        let dir = tempfile::tempdir().unwrap();
        let error = write_atomically(&dir.path().join("missing/a"), b"x", Replace::Yes).unwrap_err();
        assert!(!error.to_string().contains(".part"), "{error}");
        assert!(write_atomically(dir.path(), b"x", Replace::Yes).is_err());
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    }
}
