//! JSON documents with errors that have the path of the value.

use std::io::BufReader;
use std::path::Path;

use serde::de::DeserializeOwned;

use crate::error::LoadError;
use crate::files::read_file::open_scene_file;

/// Reads a JSON document without holding its text.
pub(super) fn read_document<T: DeserializeOwned>(path: &Path, limit: u64) -> Result<T, LoadError> {
    let mut json = serde_json::Deserializer::from_reader(BufReader::new(open_scene_file(path, limit)?));
    let value = serde_path_to_error::deserialize(&mut json).map_err(|error| {
        let place = error.path().to_string();
        json_error(path, if place == "." { "" } else { &place }, error.into_inner())
    })?;
    json.end().map_err(|error| json_error(path, "", error))?;
    Ok(value)
}

/// Reads a document on one line. Errors have the path of the value and the column.
pub(super) fn read_line<T: DeserializeOwned>(line: &[u8]) -> Result<T, String> {
    let mut json = serde_json::Deserializer::from_slice(line);
    let described = |place: &str, error: serde_json::Error| {
        let place = if place.is_empty() || place == "." { String::new() } else { format!("{place}: ") };
        let message = error.to_string();
        // The number of the line in the file is known to the caller.
        let message = message.split(" at line ").next().unwrap_or(&message);
        format!("{place}{message} at column {}", error.column())
    };
    let value = serde_path_to_error::deserialize(&mut json)
        .map_err(|error| described(&error.path().to_string(), error.into_inner()))?;
    json.end().map_err(|error| described("", error))?;
    Ok(value)
}

/// An error in a document at the path of a value; empty for the document itself.
fn json_error(path: &Path, place: &str, error: serde_json::Error) -> LoadError {
    if error.is_io() {
        return LoadError::io(path, error.into());
    }
    invalid(path, place, error)
}

/// An error of a value in a document.
pub(super) fn invalid(path: &Path, place: &str, message: impl std::fmt::Display) -> LoadError {
    let path = path.display();
    match place {
        "" => LoadError::parse(path, message),
        _ => LoadError::parse(format!("{path}, {place}"), message),
    }
}
