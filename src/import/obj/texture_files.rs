//! Looks up files that an OBJ or MTL names, with the tolerance that names from other systems need.

use std::borrow::Cow;

use percent_encoding::percent_decode_str;

use super::text::name_candidates;
use crate::import::files::scene_folder::{ReferenceError, SceneFolder};

/// Reads a file. Accepts backslashes, other folders, another case or Unicode normal form, a trailing comment and
/// percent encoding.
pub(super) fn find_file(
    folder: &SceneFolder,
    beside: &str,
    name: &str,
    limit: u64,
) -> Result<Vec<u8>, ReferenceError> {
    let exact = find_named(folder, beside, name, limit);
    // The name as written takes precedence: it may contain `#` and `%`.
    let decoded = || percent_decode_str(name).decode_utf8().ok().filter(|decoded| decoded != name);
    let others = || name_candidates(name).skip(1).map(Cow::Borrowed).chain(decoded());
    let found = || others().find_map(|name| find_named(folder, beside, &name, limit).ok());
    exact.or_else(|error| found().ok_or(error))
}

/// Reads a file by its name relative to the MTL, relative to the OBJ, and by its base name in both folders.
/// `beside` is the folder of the MTL relative to the OBJ.
pub(super) fn find_named(
    folder: &SceneFolder,
    beside: &str,
    name: &str,
    limit: u64,
) -> Result<Vec<u8>, ReferenceError> {
    let unified = name.replace('\\', "/");
    let base = unified.rsplit('/').next().unwrap_or(&unified).to_string();
    let join = |folder: &str, name: &str| {
        if folder.is_empty() { name.to_string() } else { format!("{folder}/{name}") }
    };
    let mut tried = Vec::new();
    for candidate in [join(beside, &unified), unified.clone(), join(beside, &base), base] {
        if tried.contains(&candidate) {
            continue;
        }
        match folder.read_file(&candidate, limit) {
            Ok(bytes) => return Ok(bytes),
            Err(error @ ReferenceError::TooLarge { .. }) => return Err(error),
            Err(_) => {
                if let Some(alike) = folder.find_similar(&candidate)
                    && let Ok(bytes) = folder.read_file(&alike, limit)
                {
                    return Ok(bytes);
                }
            }
        }
        tried.push(candidate);
    }
    // Return the error of the first attempt, which says whether the file is missing or refused.
    folder.read_file(&join(beside, &unified), limit)
}
