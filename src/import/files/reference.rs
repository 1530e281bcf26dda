//! Reads the files that a scene refers to, with the tolerance that references from other systems need.
//!
//! All importers use it, for images, buffers and material libraries. A reference is looked up as written, then in
//! another letter case or Unicode normal form, then by the end of its path, and last in the usual texture folders.

use std::borrow::Cow;
use std::sync::PoisonError;

use percent_encoding::percent_decode_str;

use crate::files::data_uri;
use crate::files::scene_folder::{ReferenceError, SceneFolder};
use blinn_scene::FileDigest;

#[cfg(test)]
mod tests;

/// Folders in which programs store the files of a scene, in any letter case, in the order of the search.
const USUAL_FOLDERS: [&str; 18] = [
    "textures",
    "texture",
    "tex",
    "maps",
    "map",
    "images",
    "image",
    "img",
    "materials",
    "material",
    "sourceimages",
    "source",
    "assets",
    "media",
    "resources",
    "res",
    "buffers",
    "data",
];

/// Number of parts at the end of a path that are looked up without those before them.
const MAX_PARTS: usize = 4;

impl SceneFolder {
    /// Reads a glTF URI: a data URI, or a percent-encoded path.
    pub fn read_uri(&self, uri: &str, limit: u64) -> Result<Vec<u8>, ReferenceError> {
        let trimmed = uri.trim();
        if trimmed.get(..5).is_some_and(|s| s.eq_ignore_ascii_case("data:")) {
            return data_uri::decode(trimmed, limit).map_err(ReferenceError::Refused);
        }
        let decode = |uri: &str| percent_decode_str(uri).decode_utf8_lossy().into_owned();
        // The decoded name has priority, then the name as written (a file may contain a literal '%20'), then
        // the name without query and fragment. Some exporters encode twice.
        let path = decode(uri.split(['?', '#']).next().unwrap_or(uri).trim());
        let spellings = [decode(uri).into(), uri.into(), path.as_str().into(), decode(&path).into()];
        self.read_reference(&spellings, "", limit).or_else(|error| match error {
            // The message names the file without query.
            ReferenceError::Missing(_) if path != spellings[0] => self.read_file(&path, limit),
            error => Err(error),
        })
    }

    /// Reads the file that a reference names in one of its `spellings`, the first of which has priority. `beside` is
    /// the folder of the referring file, relative to the scene's.
    ///
    /// # Errors
    /// No file is found, or it is too large. The error is that of the first spelling.
    pub fn read_reference(
        &self,
        spellings: &[Cow<'_, str>],
        beside: &str,
        limit: u64,
    ) -> Result<Vec<u8>, ReferenceError> {
        let search = Search::new(self, spellings, beside);
        let mut first_error = None;
        let mut attempt = |candidate: String| match self.read_file(&candidate, limit) {
            Err(error @ (ReferenceError::Missing(_) | ReferenceError::Refused(_))) => {
                first_error.get_or_insert(error);
                None
            }
            done => Some(done),
        };
        let found = search.full_paths().find_map(&mut attempt);
        let found = found.or_else(|| search.similar(search.full_paths()).find_map(&mut attempt));
        let found = found.or_else(|| search.similar(search.path_ends()).find_map(&mut attempt));
        let found = found.or_else(|| search.base_names().find_map(&mut attempt));
        let found = found.or_else(|| search.in_usual_folders().find_map(&mut attempt));
        let empty = || ReferenceError::Refused("the reference is empty".into());
        found.unwrap_or_else(|| Err(first_error.unwrap_or_else(empty)))
    }
}

/// The files that a reference may mean.
struct Search<'f> {
    folder: &'f SceneFolder,
    /// The spellings, with slashes.
    names: Vec<String>,
    /// Folders that names may be relative to.
    places: Vec<&'f str>,
}

impl<'f> Search<'f> {
    fn new(folder: &'f SceneFolder, spellings: &[Cow<'_, str>], beside: &'f str) -> Search<'f> {
        let mut names: Vec<String> = Vec::with_capacity(spellings.len());
        for spelling in spellings {
            let name = spelling.replace('\\', "/");
            if !names.contains(&name) {
                names.push(name);
            }
        }
        let mut places = vec![beside];
        places.extend((!beside.is_empty()).then_some(""));
        // Many archives have a folder for the scene beside one for its textures.
        places.extend(folder.allow_outside.then_some(".."));
        Search { folder, names, places }
    }

    /// The names as written, relative to each place.
    fn full_paths(&self) -> impl Iterator<Item = String> {
        let places = |name| if is_absolute(name) { &[""][..] } else { &self.places };
        self.names.iter().flat_map(move |name| places(name).iter().map(move |place| join(place, name)))
    }

    /// The last part of each name, relative to each place.
    fn base_names(&self) -> impl Iterator<Item = String> {
        let names = self.names.iter().filter_map(|name| shorter_ends(name).last());
        names.flat_map(|base| self.places.iter().map(move |place| join(place, base)))
    }

    /// The last parts of each name, relative to each place, more parts first.
    fn path_ends(&self) -> impl Iterator<Item = String> {
        let ends = self.names.iter().flat_map(|name| shorter_ends(name));
        ends.flat_map(|end| self.places.iter().map(move |place| join(place, end)))
    }

    /// Existing files whose paths differ from `paths` only in letter case and Unicode normal form.
    fn similar(&self, paths: impl Iterator<Item = String>) -> impl Iterator<Item = String> {
        paths.filter_map(|path| self.folder.find_similar(&path))
    }

    /// Existing files in the usual texture folders of each place.
    fn in_usual_folders(&self) -> impl Iterator<Item = String> {
        let folders = self.places.iter().flat_map(|place| self.folder.usual_folders(place));
        folders.flat_map(|folder| self.in_usual_folder(&folder))
    }

    /// Existing files in a folder. A missing one is recorded among the scene's sources, since the scene changes when
    /// it appears.
    fn in_usual_folder(&self, folder: &str) -> Vec<String> {
        let ends = self.names.iter().flat_map(|name| path_ends(name));
        let found: Vec<String> = self.similar(ends.map(|end| join(folder, end))).collect();
        if found.is_empty()
            && let Some(base) = self.names.first().and_then(|name| path_ends(name).last())
        {
            self.folder.sources.record_file(join(folder, base), FileDigest::Unread);
        }
        found
    }
}

impl SceneFolder {
    /// Returns the usual texture folders that exist in the folder `place`. Missing ones are recorded among the scene's
    /// sources, with a slash at the end.
    fn usual_folders(&self, place: &str) -> Vec<String> {
        let mut known = self.usual_folders.lock().unwrap_or_else(PoisonError::into_inner);
        let folders = known.entry(place.to_string()).or_insert_with(|| {
            let parent = if place.is_empty() { "." } else { place };
            let own = [
                self.stem().to_string(),
                format!("{}_textures", self.stem()),
                format!("{}.fbm", self.stem()),
            ];
            let names = USUAL_FOLDERS.into_iter().chain(own.iter().map(String::as_str));
            let existing = |name: &str| {
                let found = self.find_similar_in(parent, name).map(|actual| join(place, &actual));
                if found.is_none() {
                    self.sources.record_file(format!("{}/", join(place, name)), FileDigest::Unread);
                }
                found
            };
            names.filter_map(existing).collect()
        });
        folders.clone()
    }
}

fn join(folder: &str, name: &str) -> String {
    if folder.is_empty() { name.to_string() } else { format!("{folder}/{name}") }
}

/// Returns true for absolute paths of any operating system, and for URLs.
fn is_absolute(name: &str) -> bool {
    let has_drive = matches!(name.as_bytes(), [drive, b':', b'/', ..] if drive.is_ascii_alphabetic());
    name.starts_with('/') || has_drive || name.contains("://")
}

/// Returns the ends of a path with at most [`MAX_PARTS`] parts, the longest first.
fn path_ends(path: &str) -> impl Iterator<Item = &str> {
    let path = path.trim_end_matches('/');
    let starts = path.rmatch_indices('/').map(|(at, _)| at + 1).chain([0]).take(MAX_PARTS);
    let starts: Vec<usize> = starts.collect();
    let ends = starts.into_iter().rev().map(move |start| &path[start..]);
    ends.filter(|end| !end.is_empty() && !end.split('/').any(|part| matches!(part, "" | "." | "..")))
}

/// Returns the ends of a path except the whole.
fn shorter_ends(path: &str) -> impl Iterator<Item = &str> {
    path_ends(path).filter(move |end| end.len() < path.len())
}
