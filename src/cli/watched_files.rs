//! Files whose changes are noticed: sizes and times are looked at again and again.
//!
//! This works on disks of other computers, where the system reports no changes, and when editors replace files.

use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, SystemTime};

/// Time between looks.
const PERIOD: Duration = Duration::from_millis(500);
/// Time without a change after which files count as written.
const QUIET: Duration = Duration::from_millis(200);

/// Files with their states.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct WatchedFiles(Vec<(PathBuf, Option<FileState>)>);

/// Size, time and number of a file, which change with its content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FileState {
    length: u64,
    modified: Option<SystemTime>,
    /// The number of the file on its disk: it changes if another takes its place.
    number: u64,
}

impl WatchedFiles {
    /// Notes the state of files, whether they exist or not.
    pub fn new(paths: impl IntoIterator<Item = PathBuf>) -> WatchedFiles {
        let mut paths: Vec<PathBuf> = paths.into_iter().collect();
        paths.sort();
        paths.dedup();
        WatchedFiles(paths.into_iter().map(|path| (path.clone(), file_state(&path))).collect())
    }

    /// Number of files.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The same files as they are now.
    pub fn now(&self) -> WatchedFiles {
        WatchedFiles(self.0.iter().map(|(path, _)| (path.clone(), file_state(path))).collect())
    }

    /// True if a file changed, appeared or disappeared.
    pub fn have_changed(&self) -> bool {
        self.0.iter().any(|(path, state)| *state != file_state(path))
    }

    /// These files in their noted states, and those of `more` that are not among them as they are now.
    pub fn with(&self, more: impl IntoIterator<Item = PathBuf>) -> WatchedFiles {
        let is_known = |path: &PathBuf| self.0.iter().any(|(known, _)| known == path);
        let mut all = self.clone();
        all.0.extend(WatchedFiles::new(more.into_iter().filter(|path| !is_known(path))).0);
        all
    }

    /// Keeps some of the files.
    pub fn only(&self, keep: impl Fn(&Path) -> bool) -> WatchedFiles {
        WatchedFiles(self.0.iter().filter(|(path, _)| keep(path)).cloned().collect())
    }

    /// Waits for the time between two looks.
    pub fn pause() {
        sleep(PERIOD);
    }

    /// Waits until files that have changed are written: until they stay as they are for a moment.
    pub fn wait_until_quiet(&self) {
        let mut last = self.now();
        loop {
            sleep(QUIET);
            let now = self.now();
            if now == last {
                return;
            }
            last = now;
        }
    }
}

/// The files that a scene is made of: its own, and those that it refers to by names relative to its folder.
pub fn scene_files<'n>(scene: &Path, names: impl Iterator<Item = &'n str>) -> Vec<PathBuf> {
    let folder = scene.parent().unwrap_or(Path::new(""));
    std::iter::once(scene.to_path_buf()).chain(names.map(|name| folder.join(name))).collect()
}

/// The state of a file, or of the archive that it is in.
fn file_state(path: &Path) -> Option<FileState> {
    let metadata = path.ancestors().find_map(|path| path.metadata().ok().map(|metadata| (path, metadata)));
    let (found, metadata) = metadata?;
    // The folder of a file that is missing says nothing about it.
    if found != path && !metadata.is_file() {
        return None;
    }
    Some(FileState {
        length: metadata.len(),
        modified: metadata.modified().ok(),
        number: file_number(&metadata),
    })
}

#[cfg(unix)]
fn file_number(metadata: &std::fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(metadata)
}

#[cfg(not(unix))]
fn file_number(_: &std::fs::Metadata) -> u64 {
    0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_change_come_or_go_are_noticed() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("a"), "1").unwrap();
        let watched = || WatchedFiles::new(["a", "b"].map(at));
        let before = watched();
        assert!(!before.have_changed());
        std::fs::write(at("a"), "22").unwrap();
        assert!(before.have_changed());
        let before = watched();
        std::fs::write(at("b"), "1").unwrap();
        assert!(before.have_changed() && !before.only(|path| path.ends_with("a")).have_changed());
        // As editors save: another file takes the place.
        let before = watched();
        std::fs::write(at("new"), "22").unwrap();
        std::fs::rename(at("new"), at("a")).unwrap();
        assert!(before.have_changed());
        let before = watched();
        std::fs::remove_file(at("b")).unwrap();
        assert!(before.have_changed() && !before.now().have_changed());
        // A change before the list grew is not lost.
        std::fs::write(at("a"), "333").unwrap();
        assert!(before.now().with([at("c")]).0.len() == 3 && before.with([at("c")]).have_changed());
    }

    #[test]
    fn a_scene_in_an_archive_changes_with_it() {
        let dir = tempfile::tempdir().unwrap();
        let archive = dir.path().join("all.tar");
        std::fs::write(&archive, "1").unwrap();
        let watched = WatchedFiles::new(scene_files(&archive.join("a/b.obj"), ["b.mtl"].into_iter()));
        assert!(!watched.have_changed());
        std::fs::write(&archive, "22").unwrap();
        assert!(watched.have_changed());
    }
}
