//! What a name of a file stands for: links lead to the file itself, and not everything is one.

use std::io;
use std::path::{Path, PathBuf};

/// Links that lead to links, at most, as the system has it.
const MOST_LINKS: u32 = 40;

/// Where what is written under a name goes.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum WriteTarget {
    /// A file, there or not: a new one takes its place.
    File(PathBuf),
    /// A pipe, a device, an open file's name: it stays, and is written into.
    Stream(PathBuf),
}

impl WriteTarget {
    /// What `path` stands for. A link that leads nowhere stands for the file that it would lead to.
    pub fn of(path: &Path) -> io::Result<WriteTarget> {
        let mut path = path.to_path_buf();
        for _ in 0..MOST_LINKS {
            if path.metadata().is_ok_and(|it| !it.is_file() && !it.is_dir()) {
                return Ok(WriteTarget::Stream(path));
            }
            match path.read_link() {
                // `/dev/stdout` leads here: a new file would not be the one that is open.
                Ok(_) if path.starts_with("/proc") => return Ok(WriteTarget::Stream(path)),
                // From the link's own folder, unless it is absolute.
                Ok(target) => path = path.with_file_name("").join(target),
                Err(_) => return Ok(WriteTarget::File(path)),
            }
        }
        Err(io::Error::other("links lead to links without end"))
    }
}

/// A file's own name, however it is spelled and whichever links lead to it. Of one that is not there it is
/// the absolute name.
pub fn canonical_path(path: &Path) -> PathBuf {
    // Most are not there, which one look tells.
    let there = path.symlink_metadata().is_ok().then(|| path.canonicalize().ok()).flatten();
    there.or_else(|| std::path::absolute(path).ok()).unwrap_or_else(|| path.to_path_buf())
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn links_are_followed_to_where_they_lead() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::create_dir(at("sub")).unwrap();
        std::fs::write(at("sub/file"), "").unwrap();
        for (link, target) in [("a", "b"), ("b", "sub/file"), ("gone", "sub/new"), ("round", "round")] {
            symlink(target, at(link)).unwrap();
        }
        symlink(at("sub/file"), at("far")).unwrap();
        symlink("/dev/null", at("null")).unwrap();
        for (name, leads) in [("a", "sub/file"), ("far", "sub/file"), ("gone", "sub/new"), ("new", "new")] {
            assert_eq!(WriteTarget::of(&at(name)).unwrap(), WriteTarget::File(at(leads)), "{name}");
        }
        assert_eq!(WriteTarget::of(&at("null")).unwrap(), WriteTarget::Stream(at("null")));
        assert!(WriteTarget::of(&at("round")).is_err());
        assert_eq!(canonical_path(&at("a")), canonical_path(&at("sub/../sub/file")));
        assert_ne!(canonical_path(&at("new")), canonical_path(&at("sub/new")));
    }
}
