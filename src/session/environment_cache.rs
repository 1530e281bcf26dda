//! The last environment map that was read, for plans that are made again: a picture that is edited in the meantime is read
//! again.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::SystemTime;

use blinn_scene::Environment;

/// A file in a state.
#[derive(Clone, Debug, PartialEq, Eq)]
struct FileKey {
    path: PathBuf,
    length: u64,
    modified: SystemTime,
    /// Bytes that it may have.
    limit: u64,
}

static LAST: Mutex<Option<(FileKey, Environment)>> = Mutex::new(None);

/// Returns the environment of a file, read by `read` unless it is the last one.
///
/// # Errors
/// Those of `read`.
pub fn load_cached<E>(
    path: &Path,
    limit: u64,
    read: impl FnOnce() -> Result<Environment, E>,
) -> Result<Environment, E> {
    let Some(key) = file_key(path, limit) else { return read() };
    let last = || LAST.lock().unwrap_or_else(|e| e.into_inner());
    let known =
        last().as_ref().filter(|(known, _)| *known == key).map(|(_, environment)| environment.clone());
    if let Some(environment) = known {
        return Ok(environment);
    }
    let environment = read()?;
    // A file that changed while it was read is not remembered.
    *last() = (file_key(path, limit).as_ref() == Some(&key)).then(|| (key, environment.clone()));
    Ok(environment)
}

fn file_key(path: &Path, limit: u64) -> Option<FileKey> {
    let metadata = path.metadata().ok().filter(std::fs::Metadata::is_file)?;
    let modified = metadata.modified().ok()?;
    Some(FileKey { path: path.to_path_buf(), length: metadata.len(), modified, limit })
}

#[cfg(test)]
mod tests {
    use super::*;
    use blinn_core::geometry::Rgb;

    #[test]
    fn a_file_is_read_once_until_it_changes() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a.hdr");
        let mut reads = 0;
        let mut load = || {
            load_cached(&file, 10, || {
                reads += 1;
                Ok::<_, ()>(Environment::uniform(Rgb::splat(reads as f32)))
            })
            .unwrap()
        };
        std::fs::write(&file, "1").unwrap();
        assert_eq!(load(), load());
        std::fs::write(&file, "22").unwrap();
        assert_eq!(load(), Environment::uniform(Rgb::splat(2.0)));
        assert_eq!(reads, 2);
    }
}
