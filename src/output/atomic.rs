//! Atomic file writes: a temporary file beside the target, renamed when it is complete.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::sync::{RwLock, RwLockWriteGuard};

use tempfile::NamedTempFile;

use super::write_target::WriteTarget;
use blinn_core::worded;

/// Locked for reading while a file is written, and for writing by [`block_writes`].
static WRITES: RwLock<()> = RwLock::new(());

/// Waits until no file is being written, and blocks new writes while the guard lives. A process that exits
/// meanwhile leaves no temporary file behind.
pub fn block_writes() -> RwLockWriteGuard<'static, ()> {
    WRITES.write().unwrap_or_else(|e| e.into_inner())
}

/// Handling of an existing file at the output path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Overwrite {
    /// The new file replaces it when it is complete.
    #[default]
    Yes,
    /// Writing fails.
    No,
}

/// Writes `bytes` to a temporary file in the folder of `path` and names it `path`. After an error, and after an orderly
/// shutdown, no temporary file is left; on Linux file systems with unnamed files also not after a kill. Symbolic links
/// are followed; pipes and devices are appended to. A file that is replaced keeps its permissions.
///
/// # Errors
/// Errors of the file system, and a file that exists and must not be overwritten.
pub fn write_atomically(path: &Path, bytes: &[u8], overwrite: Overwrite) -> io::Result<()> {
    write_atomically_with(path, overwrite, |file| file.write_all(bytes))
}

/// As [`write_atomically`]; `write` writes the content.
///
/// # Errors
/// As [`write_atomically`], and the errors of `write`.
pub fn write_atomically_with(
    path: &Path,
    overwrite: Overwrite,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    check_overwrite(path, overwrite)?;
    let _writing = WRITES.read().unwrap_or_else(|e| e.into_inner());
    let path = match WriteTarget::resolve(path)? {
        WriteTarget::File(path) => path,
        WriteTarget::Stream(path) => return write(&mut OpenOptions::new().append(true).open(path)?),
    };
    #[cfg(target_os = "linux")]
    if let Some(mut file) = unnamed_file::create(folder(&path)) {
        write(&mut file)?;
        keep_permissions(&file, &path);
        file.sync_data()?;
        return unnamed_file::link(&mut file, &path, overwrite);
    }
    let mut file = named_temp_file(&path)?;
    write(file.as_file_mut())?;
    keep_permissions(file.as_file(), &path);
    file.as_file().sync_data()?;
    persist(file, &path, overwrite)
}

/// Creates a temporary file beside `path` that keeps its name after a kill.
fn named_temp_file(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = temp_name();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The default of new files; the umask applies. Temporary files are private otherwise.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder(path)).map_err(without_path)
}

/// The form of temporary names.
fn temp_name() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".blinn-").suffix(".part");
    builder
}

/// Sets the permissions of the file that will be replaced.
fn keep_permissions(file: &File, replaced: &Path) {
    #[cfg(unix)]
    if let Ok(replaced) = replaced.metadata() {
        // Some file systems have no permissions to set.
        let _ = file.set_permissions(replaced.permissions());
    }
    #[cfg(not(unix))]
    let _ = (file, replaced);
}

/// Gives a temporary file its final name.
fn persist<F>(file: NamedTempFile<F>, path: &Path, overwrite: Overwrite) -> io::Result<()> {
    match overwrite {
        Overwrite::Yes => file.persist(path),
        Overwrite::No => file.persist_noclobber(path),
    }
    .map(drop)
    .map_err(|e| e.error)
}

/// Files that have no name until they are complete: a process that is killed leaves nothing of them.
#[cfg(target_os = "linux")]
mod unnamed_file {
    use std::fs::File;
    use std::io::{self, Seek};
    use std::os::fd::AsRawFd;
    use std::path::{Path, PathBuf};

    use rustix::fs::{AtFlags, CWD, Mode, OFlags, linkat, open};
    use rustix::io::Errno;

    use super::{Overwrite, folder, named_temp_file, persist, temp_name, without_path};

    /// Creates a file in a folder. `None` where the file system has no unnamed files.
    pub fn create(folder: &Path) -> Option<File> {
        let flags = OFlags::TMPFILE | OFlags::RDWR | OFlags::CLOEXEC;
        let file = File::from(open(folder, flags, Mode::from_raw_mode(0o666)).ok()?);
        // Its name in /proc is needed later.
        descriptor_path(&file).exists().then_some(file)
    }

    /// Names a complete file.
    pub fn link(file: &mut File, path: &Path, overwrite: Overwrite) -> io::Result<()> {
        match link_as(file, path) {
            Ok(()) => return Ok(()),
            Err(Errno::EXIST) if overwrite == Overwrite::No => {
                return Err(io::Error::from(io::ErrorKind::AlreadyExists));
            }
            Err(_) => {}
        }
        // A file can be replaced only by a named one.
        if let Ok(named) = temp_name().make_in(folder(path), |name| Ok(link_as(file, name)?)) {
            return persist(named, path, overwrite);
        }
        let mut copy = named_temp_file(path)?;
        file.rewind()?;
        io::copy(file, copy.as_file_mut()).map_err(without_path)?;
        super::keep_permissions(copy.as_file(), path);
        copy.as_file().sync_data()?;
        persist(copy, path, overwrite)
    }

    fn link_as(file: &File, path: &Path) -> rustix::io::Result<()> {
        linkat(CWD, descriptor_path(file), CWD, path, AtFlags::SYMLINK_FOLLOW)
    }

    fn descriptor_path(file: &File) -> PathBuf {
        format!("/proc/self/fd/{}", file.as_raw_fd()).into()
    }
}

/// Creates an unnamed temporary file on the file system of `path`, or in the system's temporary folder if `path` is
/// a pipe or device. It vanishes with the process, even if that is killed.
///
/// # Errors
/// Errors of the file system.
pub fn unnamed_temp_file(path: &Path) -> io::Result<File> {
    match WriteTarget::resolve(path)? {
        WriteTarget::File(path) => tempfile::tempfile_in(folder(&path)),
        WriteTarget::Stream(_) => tempfile::tempfile(),
    }
    .map_err(without_path)
}

/// Checks that a file can be created at `path`, by creating an unnamed file in its folder.
pub(super) fn check_writable(path: &Path, overwrite: Overwrite) -> io::Result<()> {
    check_overwrite(path, overwrite)?;
    match WriteTarget::resolve(path)? {
        WriteTarget::File(path) => tempfile::tempfile_in(folder(&path)).map(drop).map_err(without_path),
        // The reader of a pipe would see it being opened and closed.
        WriteTarget::Stream(_) => Ok(()),
    }
}

/// Checks that `path` is no folder, and no existing file that must not be overwritten.
pub(super) fn check_overwrite(path: &Path, overwrite: Overwrite) -> io::Result<()> {
    if overwrite == Overwrite::No
        && path.exists()
        && matches!(WriteTarget::resolve(path)?, WriteTarget::File(_))
    {
        return Err(io::Error::new(
            io::ErrorKind::AlreadyExists,
            worded!("it exists and `no-overwrite` is set"),
        ));
    }
    if path.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder"));
    }
    Ok(())
}

fn folder(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Removes the name of the temporary file, which tempfile appends to the system's message.
fn without_path(error: io::Error) -> io::Error {
    let text = error.to_string();
    io::Error::new(error.kind(), text.split(" at path").next().unwrap_or(&text).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_completely_or_not_at_all() {
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
    fn a_replaced_file_keeps_its_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        let mode = || std::fs::metadata(&path).unwrap().permissions().mode() & 0o7777;
        write_atomically(&path, b"new", Overwrite::Yes).unwrap();
        assert_eq!(mode() & 0o600, 0o600);
        for kept in [0o600, 0o640, 0o664, 0o444, 0o755] {
            std::fs::set_permissions(&path, std::fs::Permissions::from_mode(kept)).unwrap();
            write_atomically(&path, b"replaced", Overwrite::Yes).unwrap();
            assert_eq!(mode(), kept, "{kept:o}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn symbolic_links_and_pipes_are_written_through() {
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

    /// While a new file is written, its folder is empty: a kill leaves nothing.
    #[cfg(target_os = "linux")]
    #[test]
    fn an_unfinished_file_has_no_name() {
        let dir = tempfile::tempdir().unwrap();
        if unnamed_file::create(dir.path()).is_none() {
            return;
        }
        let count = || std::fs::read_dir(dir.path()).unwrap().count();
        for (file, before) in [("a", 0), ("a", 1), ("b", 1)] {
            let write = |file: &mut File| {
                assert_eq!(count(), before);
                file.write_all(b"x")
            };
            write_atomically_with(&dir.path().join(file), Overwrite::Yes, write).unwrap();
        }
        assert_eq!(count(), 2);
        // Another process writes the file meanwhile.
        let path = dir.path().join("c");
        let race = |file: &mut File| {
            std::fs::write(&path, "other")?;
            file.write_all(b"x")
        };
        let error = write_atomically_with(&path, Overwrite::No, race).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(std::fs::read(&path).unwrap(), b"other");
        assert_eq!(count(), 3);
    }

    #[test]
    fn a_failed_write_leaves_no_temporary_file() {
        let dir = tempfile::tempdir().unwrap();
        let error = write_atomically(&dir.path().join("missing/a"), b"x", Overwrite::Yes).unwrap_err();
        assert!(!error.to_string().contains(".part"), "{error}");
        assert!(write_atomically(dir.path(), b"x", Overwrite::Yes).is_err());
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    }
}
