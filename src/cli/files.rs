//! Folders and names of output files.

use std::path::Path;

use anyhow::{Context, Result};

/// Creates the folder of a file if it is missing.
pub fn create_parent_folder(file: &Path) -> Result<()> {
    let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) else { return Ok(()) };
    std::fs::create_dir_all(folder).with_context(|| format!("folder {} cannot be created", folder.display()))
}

/// A relative path with slashes on every system.
pub fn with_slashes(path: &Path) -> String {
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}
