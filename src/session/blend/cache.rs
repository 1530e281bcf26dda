//! The cache of conversions: a folder with a file for each, named by a hash of all that it depends on except linked
//! files, whose digests it holds. `$BLINN_CACHE` is another folder than the user's, or `off`.

use std::env;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::conversion::Conversion;
use blinn_output::{Overwrite, write_atomically};

/// Names the folder, or switches the cache off.
const VARIABLE: &str = "BLINN_CACHE";
const OFF: &str = "off";
/// Extension of the files.
const EXTENSION: &str = "converted";
/// The files that were not used for longest are removed beyond this.
const MAX_BYTES: u64 = 4 << 30;

/// A folder of conversions.
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// The user's cache; `None` if there is none or it is off.
    pub fn of_user() -> Option<Cache> {
        let folder = match env::var_os(VARIABLE).filter(|value| !value.is_empty()) {
            Some(value) if value == OFF => return None,
            Some(value) => PathBuf::from(value),
            None => user_folder()?.join("blinn"),
        };
        Some(Cache { folder: folder.join("blend") })
    }

    /// Returns a conversion whose linked files are as they were.
    pub fn get(&self, key: u128, max_bytes: u64) -> Option<Conversion> {
        let file = File::open(self.path(key)).ok()?;
        let mut bytes = Vec::new();
        if file.metadata().ok()?.len() > max_bytes {
            return None;
        }
        Read::by_ref(&mut (&file)).take(max_bytes).read_to_end(&mut bytes).ok()?;
        let conversion = Conversion::from_bytes(bytes).filter(|found| found.is_current(max_bytes))?;
        // The time of the last use.
        let _ = File::options()
            .append(true)
            .open(self.path(key))
            .map(|file| file.set_modified(SystemTime::now()));
        Some(conversion)
    }

    /// Keeps a conversion. A folder that cannot be written to keeps none.
    pub fn put(&self, key: u128, conversion: &Conversion) {
        if create_private(&self.folder).is_ok()
            && write_atomically(&self.path(key), conversion.bytes(), Overwrite::Yes).is_ok()
        {
            self.remove_oldest(MAX_BYTES);
        }
    }

    /// Removes the files that were not used for longest, until the others have at most `max_bytes`.
    fn remove_oldest(&self, max_bytes: u64) {
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        let paths = entries.flatten().map(|entry| entry.path());
        let own = paths.filter(|path| path.extension() == Some(OsStr::new(EXTENSION)));
        let state = |path: PathBuf| {
            let metadata = path.symlink_metadata().ok()?;
            Some((metadata.modified().ok()?, metadata.len(), path))
        };
        let mut files: Vec<(SystemTime, u64, PathBuf)> = own.filter_map(state).collect();
        files.sort();
        let mut total = 0u64;
        for (_, bytes, path) in files.iter().rev() {
            total = total.saturating_add(*bytes);
            if total > max_bytes {
                let _ = fs::remove_file(path);
            }
        }
    }

    fn path(&self, key: u128) -> PathBuf {
        self.folder.join(format!("{key:032x}.{EXTENSION}"))
    }
}

/// Creates a folder that only the user can read: scenes may be secret.
fn create_private(folder: &Path) -> std::io::Result<()> {
    let mut builder = fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(folder)
}

/// The folder for what programs can make again.
fn user_folder() -> Option<PathBuf> {
    let absolute = |name: &str| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    if cfg!(windows) {
        absolute("LOCALAPPDATA")
    } else if cfg!(target_os = "macos") {
        absolute("HOME").map(|home| home.join("Library/Caches"))
    } else {
        absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache")))
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::conversion::Report;
    use super::*;

    #[test]
    fn the_files_that_were_used_last_stay() {
        let dir = tempfile::tempdir().unwrap();
        let cache = Cache { folder: dir.path().join("a/b") };
        let conversion = Conversion::new(Report::default(), &[0; 92]);
        assert_eq!(conversion.bytes().len(), 100);
        let now = SystemTime::now();
        for (key, age) in [(1, 30), (2, 20), (3, 10)] {
            cache.put(key, &conversion);
            let file = File::options().append(true).open(cache.path(key)).unwrap();
            file.set_modified(now - Duration::from_secs(age)).unwrap();
        }
        let other = cache.folder.join("other");
        fs::write(&other, [0; 1000]).unwrap();
        assert_eq!(cache.get(1, 1000).unwrap().glb(), [0; 92]);
        assert!(cache.get(4, 1000).is_none() && cache.get(1, 99).is_none());
        cache.remove_oldest(250);
        let kept = [1, 2, 3].map(|key| cache.get(key, 1000).is_some());
        assert_eq!(kept, [true, false, true]);
        assert!(other.exists());
    }

    #[test]
    fn damaged_files_and_folders_that_cannot_be_written_hold_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let cache = Cache { folder: dir.path().join("a") };
        let conversion = Conversion::new(Report::default(), b"glTF");
        cache.put(1, &conversion);
        fs::write(cache.path(1), "damaged").unwrap();
        assert!(cache.get(1, 1000).is_none());
        fs::write(dir.path().join("file"), "").unwrap();
        let cache = Cache { folder: dir.path().join("file") };
        cache.put(1, &conversion);
        assert!(cache.get(1, 1000).is_none());
    }
}
