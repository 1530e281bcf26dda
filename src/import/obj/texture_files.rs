//! Looks up files that an OBJ or MTL names.

use std::borrow::Cow;

use percent_encoding::percent_decode_str;

use super::text::name_candidates;
use crate::files::scene_folder::{ReferenceError, SceneFolder};

/// Reads a file. `beside` is the folder of the MTL relative to the OBJ. The name as written takes precedence, since
/// it may contain `#` and `%`; then the name without a trailing comment, then without percent encoding.
pub(super) fn find_file(
    folder: &SceneFolder,
    beside: &str,
    name: &str,
    limit: u64,
) -> Result<Vec<u8>, ReferenceError> {
    let decoded = percent_decode_str(name).decode_utf8().ok();
    let spellings: Vec<Cow<str>> = name_candidates(name).map(Cow::Borrowed).chain(decoded).collect();
    folder.read_reference(&spellings, beside, limit)
}
