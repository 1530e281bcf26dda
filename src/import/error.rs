//! Errors and warnings of an import.

use std::collections::HashSet;
use std::fmt;
use std::hash::{BuildHasherDefault, DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};

use blinn_core::cancellation::Cancelled;
use blinn_core::worded;

/// The reason why a file was not loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file, or a file that it needs, cannot be read.
    #[error("{}: {cause}", .path.display())]
    Io {
        /// The file's path.
        path: PathBuf,
        /// The operating system's error.
        cause: io::Error,
    },
    /// The text or the container does not follow its format.
    #[error("{location}: {message}")]
    Parse {
        /// Byte offset, line and column, or chunk.
        location: String,
        /// The defect and its remedy.
        message: String,
    },
    /// The file is well-formed but breaks a rule that the rendering depends on.
    #[error("{location}: {message}")]
    Invalid {
        /// JSON path such as `accessors[3].byteOffset`, or a line.
        location: String,
        /// The rule and how the file breaks it.
        message: String,
    },
    /// The file exceeds a limit of [`Limits`](super::Limits).
    #[error("{name}: {requested} exceeds the limit of {allowed}{}", remedy(.name))]
    Limit {
        /// The limited quantity.
        name: &'static str,
        /// The file's amount.
        requested: u64,
        /// The largest allowed amount.
        allowed: u64,
    },
    /// [`LoadOptions::cancel`](super::LoadOptions::cancel) was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The file is valid but needs a feature that is not supported.
    #[error("{0}")]
    Unsupported(String),
}

/// Name of the memory limit.
pub(crate) const MEMORY: &str = "bytes of memory";

/// Returns the option that raises a limit, as the end of a message.
fn remedy(name: &str) -> String {
    if name == MEMORY { worded!("; raise it with `max-memory`") } else { String::new() }
}

impl LoadError {
    pub(crate) fn io(path: &Path, cause: io::Error) -> LoadError {
        LoadError::Io { path: path.to_path_buf(), cause }
    }

    pub(crate) fn parse(location: impl fmt::Display, message: impl fmt::Display) -> LoadError {
        LoadError::Parse { location: location.to_string(), message: message.to_string() }
    }

    pub(crate) fn invalid(location: impl fmt::Display, message: impl fmt::Display) -> LoadError {
        LoadError::Invalid { location: location.to_string(), message: message.to_string() }
    }

    /// Returns a `Limit` error if `requested` exceeds `allowed`.
    pub(crate) fn check_limit(name: &'static str, requested: u64, allowed: u64) -> Result<(), LoadError> {
        if requested > allowed { Err(LoadError::Limit { name, requested, allowed }) } else { Ok(()) }
    }
}

/// A defect that was repaired, or a part of the file that was ignored. One line of text.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Warning {
    /// JSON path or line in the file; empty if the warning concerns the whole file.
    pub location: String,
    /// The defect and what was done about it.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.location.is_empty() {
            f.write_str(&self.message)
        } else {
            write!(f, "{}: {}", self.location, self.message)
        }
    }
}

/// Longest location and longest message of a warning, in bytes. A long name that many objects share must not be
/// stored for each.
const MAX_TEXT: usize = 400;

/// Collects warnings in order, without repetitions.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    list: Vec<Warning>,
    /// Hashes of the listed warnings, which take less memory than copies.
    known: HashSet<u64, BuildHasherDefault<DefaultHasher>>,
}

impl Warnings {
    /// Adds a warning unless it is already in the list.
    pub fn add(&mut self, location: impl fmt::Display, message: impl fmt::Display) {
        let text = |text: String| if text.len() > MAX_TEXT { shortened(&text) } else { text };
        self.push(Warning { location: text(location.to_string()), message: text(message.to_string()) });
    }

    /// Appends the warnings of another collection.
    pub fn extend(&mut self, other: Warnings) {
        other.list.into_iter().for_each(|w| self.push(w));
    }

    fn push(&mut self, warning: Warning) {
        let mut hasher = DefaultHasher::new();
        warning.hash(&mut hasher);
        if self.known.insert(hasher.finish()) {
            self.list.push(warning);
        }
    }

    pub fn into_vec(self) -> Vec<Warning> {
        self.list
    }

    /// Returns the warnings for the end of an error that they explain: `; WARNING` for each.
    pub fn into_ending(self) -> String {
        self.list.iter().map(|warning| format!("; {warning}")).collect()
    }

    /// The warnings as lines of text.
    #[cfg(test)]
    pub fn into_lines(self) -> Vec<String> {
        self.list.iter().map(ToString::to_string).collect()
    }
}

/// Returns the beginning and the end of a long text.
fn shortened(text: &str) -> String {
    let head = text.floor_char_boundary(MAX_TEXT * 2 / 3);
    let tail = text.ceil_char_boundary(text.len() - MAX_TEXT / 3);
    format!("{} … {}", &text[..head], &text[tail..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_are_shortened_and_repetitions_are_dropped() {
        let mut warnings = Warnings::default();
        for i in 0..3 {
            let name = "ü".repeat(1_000_000);
            warnings
                .add(format!("materials[{i}].{name}"), format!("texture '{name}' is missing; used white"));
            warnings.add("asset", "version is missing; used 2.0");
        }
        let list = warnings.into_vec();
        assert_eq!(list.len(), 4);
        assert!(list.iter().all(|w| w.location.len() <= MAX_TEXT + 9 && w.message.len() <= MAX_TEXT + 9));
        assert!(list[2].location.starts_with("materials[1].ü") && list[0].message.ends_with("used white"));
    }
}
