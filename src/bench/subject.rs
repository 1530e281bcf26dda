//! What is measured: files, and the standard scenes.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::scenes::{Kind, size, write_glb};

/// Folders of scenes that were made for measuring.
static FOLDERS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes what was made for measuring: for a process that is about to end out of turn.
pub fn sweep() {
    for folder in FOLDERS.lock().unwrap_or_else(|e| e.into_inner()).drain(..) {
        // There is nobody left to be told.
        let _ = std::fs::remove_dir_all(folder);
    }
}

/// A scene file and what it is called in tables.
#[derive(Debug)]
pub struct Subject {
    /// What it is called.
    pub name: String,
    /// Where it is.
    pub file: PathBuf,
    /// The folder that vanishes with it, where it was made for measuring.
    folder: Option<tempfile::TempDir>,
}

/// A standard scene that could not be written, in one line.
#[derive(Debug, thiserror::Error)]
#[error("the scene {name} cannot be written in {folder}: {cause}; set TMPDIR to a folder with room")]
pub struct SubjectError {
    name: String,
    folder: String,
    cause: std::io::Error,
}

impl Subject {
    /// A file of the user's.
    pub fn file(path: &Path) -> Subject {
        Subject { name: path.to_string_lossy().into_owned(), file: path.to_path_buf(), folder: None }
    }

    /// A standard scene of about so many triangles as stored, written to a passing file.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn made(kind: Kind, triangles: usize) -> Result<Subject, SubjectError> {
        let scene = kind.make(triangles);
        let name = format!("{kind} {}", size(scene.stored()));
        let write = || {
            let folder = tempfile::tempdir()?;
            FOLDERS.lock().unwrap_or_else(|e| e.into_inner()).push(folder.path().to_path_buf());
            let file = folder.path().join(format!("{kind}.glb"));
            write_glb(&scene, &file)?;
            Ok((folder, file))
        };
        match write() {
            Ok((folder, file)) => Ok(Subject { name, file, folder: Some(folder) }),
            Err(cause) => {
                let folder = std::env::temp_dir().display().to_string();
                Err(SubjectError { name, folder, cause })
            }
        }
    }

    /// True of a scene that was made for measuring.
    pub fn is_made(&self) -> bool {
        self.folder.is_some()
    }
}

/// The standard scenes: every kind in each of these sizes, in triangles as stored; kinds that are
/// larger than a size at their least come once.
pub fn suite(sizes: &[usize]) -> Vec<(Kind, usize)> {
    let mut all: Vec<(Kind, usize)> = Vec::new();
    for kind in Kind::ALL {
        for &size in sizes {
            let one = (kind, size.max(kind.least()) & !1);
            if !all.contains(&one) {
                all.push(one);
            }
        }
    }
    all
}
