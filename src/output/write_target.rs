//! Resolves output paths: follows symbolic links, and distinguishes files from pipes and devices.

use std::io;
use std::path::{Path, PathBuf};

/// Symbolic links that are followed, as in Linux.
const MAX_LINKS: u32 = 40;

/// Where output to a path goes.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum WriteTarget {
    /// A file, existing or not, that a new file replaces.
    File(PathBuf),
    /// A pipe, a device or the name of an open file: it is written into.
    Stream(PathBuf),
}

impl WriteTarget {
    /// Follows the links of `path`. A dangling link resolves to the file that it names.
    pub fn resolve(path: &Path) -> io::Result<WriteTarget> {
        let mut path = path.to_path_buf();
        for _ in 0..MAX_LINKS {
            if path.metadata().is_ok_and(|it| !it.is_file() && !it.is_dir()) {
                return Ok(WriteTarget::Stream(path));
            }
            match path.read_link() {
                // `/dev/stdout` resolves to this: replacing the file would not write to the open one.
                Ok(_) if path.starts_with("/proc") => return Ok(WriteTarget::Stream(path)),
                // Relative to the folder of the link, unless it is absolute.
                Ok(target) => path = path.with_file_name("").join(target),
                Err(_) => return Ok(WriteTarget::File(path)),
            }
        }
        Err(io::Error::other("too many levels of symbolic links"))
    }
}

/// The canonical path of an existing file, however it is spelled and linked; the absolute path of a missing one.
pub fn canonical_path(path: &Path) -> PathBuf {
    // Most output files do not exist, which a single system call tells.
    let exists = path.symlink_metadata().is_ok();
    let canonical = exists.then(|| path.canonicalize().ok()).flatten();
    canonical.or_else(|| std::path::absolute(path).ok()).unwrap_or_else(|| path.to_path_buf())
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn links_resolve_to_their_targets() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir(at("sub")).unwrap();
        std::fs::write(at("sub/file"), "").unwrap();
        for (link, target) in [("a", "b"), ("b", "sub/file"), ("dangling", "sub/new"), ("loop", "loop")] {
            symlink(target, at(link)).unwrap();
        }
        symlink(at("sub/file"), at("absolute")).unwrap();
        symlink("/dev/null", at("null")).unwrap();
        for (name, target) in
            [("a", "sub/file"), ("absolute", "sub/file"), ("dangling", "sub/new"), ("new", "new")]
        {
            assert_eq!(WriteTarget::resolve(&at(name)).unwrap(), WriteTarget::File(at(target)), "{name}");
        }
        assert_eq!(WriteTarget::resolve(&at("null")).unwrap(), WriteTarget::Stream(at("null")));
        assert!(WriteTarget::resolve(&at("loop")).is_err());
        assert_eq!(canonical_path(&at("a")), canonical_path(&at("sub/../sub/file")));
        assert_ne!(canonical_path(&at("new")), canonical_path(&at("sub/new")));
    }
}
