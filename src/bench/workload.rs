//! What is measured: files, and the standard scenes.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::scenes::{SceneKind, format_triangle_count, write_glb};

/// Folders of scenes that were made for measuring.
static FOLDERS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes what was made for measuring: for a process that is about to end out of turn.
pub fn remove_generated_scenes() {
    for folder in FOLDERS.lock().unwrap_or_else(|e| e.into_inner()).drain(..) {
        // There is nobody left to be told.
        let _ = std::fs::remove_dir_all(folder);
    }
}

/// A scene file and what it is called in tables.
#[derive(Debug)]
pub struct Workload {
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
pub struct WorkloadError {
    name: String,
    folder: String,
    cause: std::io::Error,
}

impl Workload {
    /// A file of the user's.
    pub fn file(path: &Path) -> Workload {
        Workload { name: path.to_string_lossy().into_owned(), file: path.to_path_buf(), folder: None }
    }

    /// A standard scene of about so many triangles as stored, written to a passing file.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn generate(kind: SceneKind, triangles: usize) -> Result<Workload, WorkloadError> {
        let scene = kind.generate(triangles);
        let name = format!("{kind} {}", format_triangle_count(scene.stored_triangles()));
        let write = || {
            let folder = tempfile::tempdir()?;
            FOLDERS.lock().unwrap_or_else(|e| e.into_inner()).push(folder.path().to_path_buf());
            let file = folder.path().join(format!("{kind}.glb"));
            write_glb(&scene, &file)?;
            Ok((folder, file))
        };
        match write() {
            Ok((folder, file)) => Ok(Workload { name, file, folder: Some(folder) }),
            Err(cause) => {
                let folder = std::env::temp_dir().display().to_string();
                Err(WorkloadError { name, folder, cause })
            }
        }
    }

    /// True of a scene that was made for measuring.
    pub fn is_generated(&self) -> bool {
        self.folder.is_some()
    }
}

/// The standard scenes: every kind in each of these sizes, in triangles as stored; kinds that are
/// larger than a size at their least come once.
pub fn standard_suite(sizes: &[usize]) -> Vec<(SceneKind, usize)> {
    let mut all: Vec<(SceneKind, usize)> = Vec::new();
    for kind in SceneKind::ALL {
        for &size in sizes {
            let one = (kind, size.max(kind.min_triangles()) & !1);
            if !all.contains(&one) {
                all.push(one);
            }
        }
    }
    all
}
