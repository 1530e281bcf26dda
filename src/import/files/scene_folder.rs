//! Resolves paths relative to the scene's folder, and reads files inside it.

use std::collections::HashMap;
use std::io;
use std::path::{Component, MAIN_SEPARATOR, Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::error::LoadError;
use crate::files::escape::printable;
use crate::files::name_match;
use crate::files::read_file::{FILE_SIZE, read_limited, reject_lfs_pointer};
use crate::files::source_tracker::SourceTracker;
use crate::files::tar_archive::{ArchivePath, file_version};
use blinn_core::cancellation::CancelToken;
use blinn_core::worded;
use blinn_scene::FileDigest;

#[cfg(test)]
mod tests;

/// The folder that a scene's references are relative to.
#[derive(Debug)]
pub(crate) struct SceneFolder {
    path: PathBuf,
    /// The scene's file name without extension.
    stem: String,
    pub allow_outside: bool,
    /// The folder inside the archive that the scene is in.
    archive: Option<ArchivePath>,
    /// Ends the import early.
    pub cancel: CancelToken,
    /// Contents of all files that were looked up, by their names relative to this folder.
    pub sources: SourceTracker,
    /// File names of each folder that was searched for similar names, by their case-folded form. Cached,
    /// since thousands of files may be missing from a folder of thousands.
    listings: Mutex<HashMap<PathBuf, HashMap<String, Vec<String>>>>,
    /// Usual texture folders that exist in each folder that was searched.
    pub usual_folders: Mutex<HashMap<String, Vec<String>>>,
}

/// The reason why a reference was not read.
#[derive(Debug)]
pub(crate) enum ReferenceError {
    /// The reference leaves the folder or is no file name.
    Refused(String),
    /// The file does not exist or cannot be read.
    Missing(String),
    /// The file exceeds the size limit.
    TooLarge { message: String, bytes: u64 },
}

impl ReferenceError {
    pub fn message(&self) -> &str {
        match self {
            ReferenceError::Refused(message)
            | ReferenceError::Missing(message)
            | ReferenceError::TooLarge { message, .. } => message,
        }
    }

    /// Returns the `Limit` error of a file that is too large: unlike a missing file, it stops the import.
    pub fn limit_error(&self, allowed: u64) -> Option<LoadError> {
        match *self {
            ReferenceError::TooLarge { bytes, .. } => {
                Some(LoadError::Limit { name: FILE_SIZE, requested: bytes, allowed })
            }
            _ => None,
        }
    }
}

impl SceneFolder {
    /// The folder that holds the file `scene`.
    pub fn of(scene: &Path, allow_outside: bool) -> SceneFolder {
        let parent = scene.parent().filter(|p| !p.as_os_str().is_empty());
        let path = parent.unwrap_or(Path::new(".")).to_path_buf();
        let stem = scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        SceneFolder {
            archive: ArchivePath::of(scene).and_then(|inside| inside.ok()?.parent()),
            path,
            stem,
            allow_outside,
            cancel: CancelToken::default(),
            sources: SourceTracker::default(),
            listings: Mutex::default(),
            usual_folders: Mutex::default(),
        }
    }

    /// Sets the token that ends the import.
    pub fn with_cancel(self, cancel: &CancelToken) -> SceneFolder {
        SceneFolder { cancel: cancel.clone(), ..self }
    }

    /// The scene's file name without extension.
    pub fn stem(&self) -> &str {
        &self.stem
    }

    /// The scene's file name with another extension.
    pub fn with_extension(&self, extension: &str) -> String {
        format!("{}.{extension}", self.stem)
    }

    /// Reads a file by a relative path with the separators of any operating system.
    pub fn read_file(&self, name: &str, limit: u64) -> Result<Vec<u8>, ReferenceError> {
        let path = match self.resolve(name) {
            Ok(path) => path,
            Err(refused @ ReferenceError::Refused(_)) => return Err(refused),
            Err(e) => {
                self.sources.record_file(self.normalize(name), FileDigest::Unread);
                return Err(e);
            }
        };
        let read = self.read_path(&path, limit);
        let content = read.as_ref().map_or(FileDigest::Unread, |bytes| FileDigest::of(bytes));
        self.sources.record_file(self.normalize(name), content);
        read.and_then(reject_lfs_pointer).map_err(|e| {
            let message = format!("'{}' cannot be read: {e}", printable(name));
            match file_version(&path) {
                Some((bytes, ..)) if e.kind() == io::ErrorKind::FileTooLarge => {
                    ReferenceError::TooLarge { message, bytes }
                }
                _ => ReferenceError::Missing(message),
            }
        })
    }

    /// Reads a resolved path.
    fn read_path(&self, path: &Path, limit: u64) -> io::Result<Vec<u8>> {
        match self.inside_archive(path) {
            Some(inside) => inside.read(limit),
            None => read_limited(path, limit),
        }
    }

    /// The member that a resolved path names, if the scene is in an archive.
    fn inside_archive(&self, path: &Path) -> Option<ArchivePath> {
        let archive = self.archive.as_ref()?.archive.clone();
        let name = archive.name_of(path)?;
        Some(ArchivePath { archive, name })
    }

    /// Returns true if a resolved path names a file or a folder.
    fn exists(&self, path: &Path) -> bool {
        match self.inside_archive(path) {
            Some(ArchivePath { archive, name }) => archive.has_file(&name) || archive.has_folder(&name),
            None => path.exists(),
        }
    }

    /// The names in a folder with a resolved path, in any order.
    fn entries(&self, path: &Path) -> Vec<String> {
        match self.inside_archive(path) {
            Some(ArchivePath { archive, name }) => archive.entries(&name),
            None => {
                let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
                entries.filter_map(|entry| entry.file_name().into_string().ok()).collect()
            }
        }
    }

    /// Finds an existing file whose path differs from `name` only in letter case and Unicode normal form.
    pub fn find_similar(&self, name: &str) -> Option<String> {
        let normalized = self.normalize(name);
        let mut path = String::from(".");
        for part in normalized.split('/').filter(|part| !part.is_empty() && *part != ".") {
            // Appended in place: a name may consist of a million parent steps.
            if part == ".." {
                path.push_str("/..");
                continue;
            }
            let exact = format!("{path}/{part}");
            if self.resolve(&exact).is_ok_and(|path| self.exists(&path)) {
                path = exact;
                continue;
            }
            let similar = self.find_similar_in(&path, part)?;
            path = format!("{path}/{similar}");
        }
        Some(path)
    }

    /// Finds the entry of a folder whose name is most similar to `part`.
    pub fn find_similar_in(&self, folder: &str, part: &str) -> Option<String> {
        let path = self.resolve(folder).ok()?;
        let mut listings = self.listings.lock().unwrap_or_else(PoisonError::into_inner);
        let listing = listings.entry(path).or_insert_with_key(|path| {
            let mut names: HashMap<String, Vec<String>> = HashMap::new();
            for name in self.entries(path) {
                names.entry(name_match::fold_case(&name)).or_default().push(name);
            }
            names
        });
        // The same case has priority, then alphabetical order, so that the result does not depend on
        // directory order.
        let decomposed = name_match::decompose(part);
        let similar = listing.get(&name_match::fold_case(part))?.iter();
        similar.min_by_key(|&name| (name_match::decompose(name) != decomposed, name)).cloned()
    }

    /// Normalizes a name lexically: unifies separators, removes `.` and `..` where possible, and makes paths
    /// that lead into this folder relative to it. Does not access the file system outside.
    fn normalize(&self, name: &str) -> String {
        let name = name.replace('\\', "/");
        let local = ["file://localhost", "file://"].iter().find_map(|scheme| name.strip_prefix(scheme));
        let name = local.filter(|path| path.starts_with('/')).unwrap_or(&name);
        if name.contains("://") {
            return name.to_string();
        }
        let path = remove_dots(Path::new(name));
        let inside = if path.is_absolute() || path.starts_with("..") {
            let roots = [std::path::absolute(&self.path), self.path.canonicalize()];
            let inside =
                |root: &PathBuf| remove_dots(&root.join(&path)).strip_prefix(root).map(PathBuf::from);
            roots.iter().flatten().find_map(|root| inside(root).ok())
        } else {
            None
        };
        inside.unwrap_or(path).to_string_lossy().replace(MAIN_SEPARATOR, "/")
    }

    /// Resolves a name to a path that is proven to lie inside the folder, unless files outside are allowed.
    pub fn resolve(&self, name: &str) -> Result<PathBuf, ReferenceError> {
        let refuse = |why: &str| Err(ReferenceError::Refused(format!("'{}' {why}", printable(name))));
        if name.is_empty() || name.contains('\0') {
            return refuse("is not a file name");
        }
        let relative = self.normalize(name);
        let outside =
            worded!("is outside the scene's folder and was not read; allow it with `allow-outside`");
        // A colon without slashes is part of a file name. Drive letters are path prefixes on Windows.
        if relative.contains("://") {
            return refuse("is not a local file and was not read");
        }
        if self.allow_outside && self.archive.is_none() {
            return Ok(self.path.join(relative));
        }
        let mut depth = 0i32;
        for part in Path::new(&relative).components() {
            match part {
                Component::Normal(_) => depth += 1,
                Component::CurDir => {}
                Component::ParentDir => depth -= 1,
                Component::RootDir | Component::Prefix(_) => return refuse(&outside),
            }
            if depth < 0 && !self.allow_outside {
                return refuse(&outside);
            }
        }
        let path = self.path.join(&relative);
        if self.archive.is_some() {
            return match self.inside_archive(&path) {
                // Nothing outside the archive is ever read.
                None => refuse("is outside the archive and was not read"),
                Some(ArchivePath { archive, name }) if self.exists(&path) => Ok(archive.path().join(name)),
                Some(_) => Err(ReferenceError::Missing(format!(
                    "'{}' cannot be read: no such file in the archive",
                    printable(name)
                ))),
            };
        }
        // A symbolic link may still lead outside.
        let missing =
            |e: io::Error| ReferenceError::Missing(format!("'{}' cannot be read: {e}", printable(name)));
        let real = path.canonicalize().map_err(missing)?;
        let root = self.path.canonicalize().map_err(missing)?;
        if real.starts_with(&root) { Ok(real) } else { refuse(&outside) }
    }
}

/// Removes `.` and `folder/..` from a path lexically, as in RFC 3986: the folder need not exist.
fn remove_dots(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for step in path.components() {
        match (step, out.components().next_back()) {
            (Component::CurDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => {
                out.pop();
            }
            _ => out.push(step),
        }
    }
    out
}
