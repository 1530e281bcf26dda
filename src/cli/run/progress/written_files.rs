//! Reports of written files: a line each, or of many files a line for each scene.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::Instant;

use crate::plural::plural;

/// Number of files up to which each has a line of its own.
pub const LISTED: u64 = 50;

/// The files of a run, and those of the scene that is reported.
pub struct WrittenFiles {
    since: Instant,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    /// True if no file has a line of its own.
    are_many: bool,
    /// Number of files that have a line of their own.
    listed: u64,
    /// Number of files that have none.
    unlisted: u64,
    /// Number of scenes that they are of.
    scenes: u64,
    scene: SceneFiles,
}

/// Files of a scene without lines of their own.
#[derive(Debug, Default)]
struct SceneFiles {
    count: u64,
    /// The first.
    file: PathBuf,
    /// The folder that has all of them.
    folder: PathBuf,
}

impl WrittenFiles {
    pub fn new() -> WrittenFiles {
        WrittenFiles { since: Instant::now(), state: Mutex::default() }
    }

    /// Sets the number of files that are probably written; of many, none has a line of its own.
    pub fn expect(&self, files: u64) {
        self.state().are_many = files > LISTED;
    }

    /// Adds a file of a scene. Returns true if it has a line of its own.
    pub fn add(&self, file: &Path) -> bool {
        let mut state = self.state();
        if !state.are_many && state.listed < LISTED {
            state.listed += 1;
            return true;
        }
        state.unlisted += 1;
        let folder = file.parent().unwrap_or(Path::new(""));
        let scene = &mut state.scene;
        if scene.count == 0 {
            (scene.file, scene.folder) = (file.into(), folder.into());
        } else {
            scene.folder = common_folder(&scene.folder, folder);
        }
        scene.count += 1;
        false
    }

    /// Ends a scene. Returns the line about its files that have none of their own.
    pub fn end_scene(&self) -> Option<String> {
        let mut state = self.state();
        let SceneFiles { count, file, folder } = std::mem::take(&mut state.scene);
        if count == 0 {
            return None;
        }
        state.scenes += 1;
        if count == 1 {
            return Some(format!("wrote {}", file.display()));
        }
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
        Some(format!("wrote {} to {}", plural(count, "file"), folder.join("").display()))
    }

    /// One line about all files, if there are some without lines of their own.
    pub fn totals(&self) -> Option<String> {
        let state = self.state();
        let files = plural(state.listed + state.unlisted, "file");
        let seconds = self.since.elapsed().as_secs_f64();
        (state.scenes > 1).then(|| format!("wrote {files} in all, {seconds:.1} s"))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }
}

fn common_folder(a: &Path, b: &Path) -> PathBuf {
    let pairs = a.components().zip(b.components());
    pairs.take_while(|(a, b)| a == b).map(|(component, _)| component).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_files_have_a_line_for_each_scene() {
        let files = WrittenFiles::new();
        files.expect(LISTED + 1);
        assert!(!files.add(Path::new("out/a/1.png")) && !files.add(Path::new("out/a/depth/1.png")));
        assert_eq!(files.end_scene().unwrap(), "wrote 2 files to out/a/");
        assert_eq!((files.end_scene(), files.totals()), (None, None));
        files.add(Path::new("1.png"));
        assert_eq!(files.end_scene().unwrap(), "wrote 1.png");
        assert!(files.totals().unwrap().starts_with("wrote 3 files in all, "));
    }

    #[test]
    fn files_beyond_the_first_are_counted_if_their_number_is_not_known() {
        let files = WrittenFiles::new();
        assert_eq!((0..60).filter(|i| files.add(Path::new(&format!("{i}.png")))).count() as u64, LISTED);
        assert_eq!(files.end_scene().unwrap(), "wrote 10 files to ./");
    }
}
