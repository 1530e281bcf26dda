//! Benchmark workloads: scene files, and the generated standard scenes.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::camera::BenchCamera;
use super::manifest::ManifestScene;
use super::scenes::{SceneKind, format_triangle_count, write_glb};

/// Temporary folders of generated scenes.
static FOLDERS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes the temporary files of generated scenes, for a process that is about to be terminated.
pub fn remove_generated_scenes() {
    for folder in FOLDERS.lock().unwrap_or_else(|e| e.into_inner()).drain(..) {
        // An error cannot be reported any more.
        let _ = std::fs::remove_dir_all(folder);
    }
}

/// A scene file to measure.
#[derive(Debug)]
pub struct Workload {
    /// The name in tables.
    pub name: String,
    /// The file.
    pub file: PathBuf,
    /// SHA-256 of the file in hexadecimal digits, if it was computed.
    pub sha256: Option<String>,
    /// SHA-256 of the file that the manifest describes, where it is known.
    pub expected_sha256: Option<String>,
    /// The cameras that it is measured from; empty for the default view.
    pub cameras: Vec<BenchCamera>,
    /// The temporary folder of a generated scene.
    folder: Option<tempfile::TempDir>,
}

/// A standard scene that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("the scene {name} cannot be written in {folder}: {cause}; set TMPDIR to a folder with free space")]
pub struct WorkloadError {
    name: String,
    folder: String,
    cause: std::io::Error,
}

impl Workload {
    /// An existing file.
    pub fn file(path: &Path) -> Workload {
        Workload {
            name: path.to_string_lossy().into_owned(),
            file: path.to_path_buf(),
            sha256: None,
            expected_sha256: None,
            cameras: Vec::new(),
            folder: None,
        }
    }

    /// A scene of the manifest of public scenes in its file.
    pub fn public(scene: ManifestScene, file: &Path) -> Workload {
        let ManifestScene { name, sha256, cameras, .. } = scene;
        Workload { name, expected_sha256: sha256, cameras, ..Workload::file(file) }
    }

    /// Generates a standard scene of about `triangles` stored triangles, in a temporary file.
    ///
    /// # Errors
    /// The file cannot be written.
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
            Ok((folder, file)) => Ok(Workload { name, folder: Some(folder), ..Workload::file(&file) }),
            Err(cause) => {
                let folder = std::env::temp_dir().display().to_string();
                Err(WorkloadError { name, folder, cause })
            }
        }
    }

    /// Returns true if this is a generated scene.
    pub fn is_generated(&self) -> bool {
        self.folder.is_some()
    }
}

/// The standard scenes: each kind in each of these sizes, in stored triangles. Sizes below the minimum of a kind are
/// raised to it, without duplicates.
pub fn standard_suite(sizes: &[usize]) -> Vec<(SceneKind, usize)> {
    let mut suite: Vec<(SceneKind, usize)> = Vec::new();
    for kind in SceneKind::ALL {
        for &size in sizes {
            let entry = (kind, size.max(kind.min_triangles()) & !1);
            if !suite.contains(&entry) {
                suite.push(entry);
            }
        }
    }
    suite
}
