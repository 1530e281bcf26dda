//! Whole files or none.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::sync::{RwLock, RwLockWriteGuard};

use super::write_target::WriteTarget;

/// Read by whoever writes a file, written by whoever must not find one half-written.
static WRITING: RwLock<()> = RwLock::new(());

/// Waits until no file is being written, and keeps it so while the guard lives. A process that
/// ends meanwhile leaves nothing partial.
pub fn block_writes() -> RwLockWriteGuard<'static, ()> {
    WRITING.write().unwrap_or_else(|e| e.into_inner())
}

/// What becomes of a file that is there already.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Overwrite {
    /// The new file takes its place once it is complete.
    #[default]
    Yes,
    /// It stays, and writing fails.
    No,
}

/// Writes `bytes` under a passing name beside `path`, and moves them there when they are all on
/// disk. On any error, and when the process is stopped in order, nothing is left behind. A link to a
/// file stays one, to the new file; pipes and devices are written into.
///
/// # Errors
/// What the system said, or that the file exists where it must not be replaced.
pub fn write_atomically(path: &Path, bytes: &[u8], replace: Overwrite) -> io::Result<()> {
    write_atomically_with(path, replace, |file| file.write_all(bytes))
}

/// As [`write_atomically`], of what `write` puts into the file.
///
/// # Errors
/// As [`write_atomically`], or what `write` says.
pub fn write_atomically_with(
    path: &Path,
    replace: Overwrite,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    check_overwrite(path, replace)?;
    let _writing = WRITING.read().unwrap_or_else(|e| e.into_inner());
    let path = match WriteTarget::of(path)? {
        WriteTarget::File(path) => path,
        WriteTarget::Stream(path) => return write(&mut OpenOptions::new().append(true).open(path)?),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".blinn-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As any program's files: the umask takes away what it must.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder(&path)).map_err(without_path)?;
    write(file.as_file_mut())?;
    file.as_file().sync_data()?;
    match replace {
        Overwrite::Yes => file.persist(path),
        Overwrite::No => file.persist_noclobber(path),
    }
    .map(drop)
    .map_err(|e| e.error)
}

/// A file without a name, on the disk that `path` is on: it is gone when the process is, however that ends.
/// For a pipe or a device, which is on none, it lies where passing files do.
///
/// # Errors
/// What the system said.
pub fn unnamed_temp_file(path: &Path) -> io::Result<File> {
    match WriteTarget::of(path)? {
        WriteTarget::File(path) => tempfile::tempfile_in(folder(&path)),
        WriteTarget::Stream(_) => tempfile::tempfile(),
    }
    .map_err(without_path)
}

/// Tries whether a file could be written at `path`. No file is seen there meanwhile.
pub(super) fn check_writable(path: &Path, replace: Overwrite) -> io::Result<()> {
    check_overwrite(path, replace)?;
    match WriteTarget::of(path)? {
        WriteTarget::File(path) => tempfile::tempfile_in(folder(&path)).map(drop).map_err(without_path),
        // Who is at a pipe's other end would see that it was opened.
        WriteTarget::Stream(_) => Ok(()),
    }
}

/// Whether a file may appear at `path`.
pub(super) fn check_overwrite(path: &Path, replace: Overwrite) -> io::Result<()> {
    if replace == Overwrite::No && path.exists() && matches!(WriteTarget::of(path)?, WriteTarget::File(_)) {
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
        write_atomically(&path, b"one", Overwrite::Yes).unwrap();
        write_atomically(&path, b"two", Overwrite::Yes).unwrap();
        assert!(write_atomically(&path, b"three", Overwrite::No).is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"two");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_pipes_stay_what_they_are() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let write = |name: &str| write_atomically(&at(name), name.as_bytes(), Overwrite::Yes);
        std::fs::create_dir(at("sub")).unwrap();
        std::fs::write(at("sub/old"), "").unwrap();
        for (link, target) in [("to old", "sub/old"), ("to new", "sub/new"), ("to null", "/dev/null")] {
            std::os::unix::fs::symlink(target, at(link)).unwrap();
            write(link).unwrap();
            assert!(at(link).is_symlink(), "{link}");
        }
        assert!(write_atomically(&at("to old"), b"kept", Overwrite::No).is_err());
        write_atomically(&at("to null"), b"nothing is replaced", Overwrite::No).unwrap();
        assert_eq!(std::fs::read(at("sub/old")).unwrap(), b"to old");
        assert_eq!(std::fs::read(at("sub/new")).unwrap(), b"to new");
        assert_eq!(std::fs::read_dir(at("sub")).unwrap().count(), 2);
        assert!(std::process::Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
        check_writable(&at("pipe"), Overwrite::Yes).unwrap();
        let reader = std::thread::spawn({
            let pipe = at("pipe");
            move || std::fs::read(pipe)
        });
        write("pipe").unwrap();
        assert_eq!(reader.join().unwrap().unwrap(), b"pipe");
    }

    #[test]
    fn nothing_is_left_where_nothing_can_be_written() {
        let dir = tempfile::tempdir().unwrap();
        let error = write_atomically(&dir.path().join("missing/a"), b"x", Overwrite::Yes).unwrap_err();
        assert!(!error.to_string().contains(".part"), "{error}");
        assert!(write_atomically(dir.path(), b"x", Overwrite::Yes).is_err());
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    }
}
