//! JSON documents with errors that have the path of the value.

use std::io::{BufRead, BufReader};
use std::path::Path;

use serde::de::DeserializeOwned;

use super::json_numbers::{FiniteTokens, replace_non_finite};
use crate::error::LoadError;
use crate::files::read_file::open_scene_file;

/// UTF-8's byte order mark.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Reads a JSON document without holding its text. It may begin with a byte order mark, and NaN and infinities may stand
/// where their value is not needed.
pub(super) fn read_document<T: DeserializeOwned>(path: &Path, limit: u64) -> Result<T, LoadError> {
    let mut reader = BufReader::new(open_scene_file(path, limit)?);
    let start = reader.fill_buf().map_err(|e| LoadError::io(path, e))?;
    let mark = if start.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 };
    reader.consume(mark);
    let mut json = serde_json::Deserializer::from_reader(BufReader::new(FiniteTokens::new(reader)));
    let value = serde_path_to_error::deserialize(&mut json).map_err(|error| {
        let place = error.path().to_string();
        json_error(path, if place == "." { "" } else { &place }, error.into_inner())
    })?;
    json.end().map_err(|error| json_error(path, "", error))?;
    Ok(value)
}

/// Reads a document on one line. Errors have the path of the value and the column.
pub(super) fn read_line<T: DeserializeOwned>(line: &[u8]) -> Result<T, String> {
    let line = replace_non_finite(line);
    let mut json = serde_json::Deserializer::from_slice(&line);
    let described = |place: &str, error: serde_json::Error| {
        let place = if place.is_empty() || place == "." { String::new() } else { format!("{place}: ") };
        let message = message(&error);
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
    invalid(path, place, message(&error))
}

/// The text of an error. Numbers that are not finite are out of the range of all numbers.
fn message(error: &serde_json::Error) -> String {
    error.to_string().replace("number out of range", "expected a finite number")
}

/// An error of a value in a document.
pub(super) fn invalid(path: &Path, place: &str, message: impl std::fmt::Display) -> LoadError {
    let path = path.display();
    match place {
        "" => LoadError::parse(path, message),
        _ => LoadError::parse(format!("{path}, {place}"), message),
    }
}
