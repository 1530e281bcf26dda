//! Folders and names of output files.

use std::path::Path;

use anyhow::{Context, Result};
use blinn_core::closest_name::closest_name;

/// Entries of a folder that are looked through for a similar name.
const MAX_ENTRIES: usize = 10_000;

/// Creates the folder of a file if it is missing.
pub fn create_parent_folder(file: &Path) -> Result<()> {
    let Some(folder) = file.parent().filter(|folder| !folder.as_os_str().is_empty()) else { return Ok(()) };
    std::fs::create_dir_all(folder).with_context(|| format!("folder {} cannot be created", folder.display()))
}

/// Returns `; did you mean 'FILE'?` for the end of a message, if a file is missing whose folder has one with a similar
/// name.
pub fn similar_file(missing: &Path) -> String {
    let name = missing.file_name().and_then(|name| name.to_str());
    let Some(name) = name.filter(|_| missing.try_exists().is_ok_and(|exists| !exists)) else {
        return String::new();
    };
    let folder = missing.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).into_iter().flatten().take(MAX_ENTRIES).flatten();
    let mut names: Vec<String> = entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    // Folders list their files in any order.
    names.sort_unstable();
    closest_name(name, &names)
        .map(|other| format!("; did you mean '{}'?", missing.with_file_name(other).display()))
        .unwrap_or_default()
}

/// A relative path with slashes on every system.
pub fn with_slashes(path: &Path) -> String {
    let parts: Vec<_> = path.iter().map(|part| part.to_string_lossy()).collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_files_have_a_suggestion_if_a_similar_one_exists() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for name in ["chair.glb", "chairs.glb", "table.obj"] {
            std::fs::write(at(name), "").unwrap();
        }
        let expected = format!("; did you mean '{}'?", at("chair.glb").display());
        assert_eq!(similar_file(&at("chaer.glb")), expected);
        for name in ["chair.glb", "wardrobe.obj", "gone/chair.glb", "chair.glb/x.glb"] {
            assert_eq!(similar_file(&at(name)), "", "{name}");
        }
    }
}
