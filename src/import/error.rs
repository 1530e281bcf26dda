//! What goes wrong while reading, and what went well enough.

use std::collections::HashSet;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file is not a scene.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file, or a file that it needs, cannot be read.
    #[error("{}: {cause}", .path.display())]
    Io {
        /// Which file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// The text or the container does not follow its format.
    #[error("{place}: {what}")]
    Parse {
        /// Where: byte offset, line and column, or chunk.
        place: String,
        /// What is wrong, and what to do.
        what: String,
    },
    /// The format is kept, but a rule is broken that a picture depends on.
    #[error("{place}: {rule}")]
    Invalid {
        /// Where: a JSON path such as `accessors[3].byteOffset`, or a line.
        place: String,
        /// The rule, and how it is broken.
        rule: String,
    },
    /// More of something than was allowed.
    #[error("{name}: {asked} is over the limit of {allowed}{}", remedy(.name))]
    Limit {
        /// What there is too much of.
        name: &'static str,
        /// How much the file wants.
        asked: u64,
        /// How much is allowed.
        allowed: u64,
    },
    /// Well-formed, and not something that blinn can show.
    #[error("{0}")]
    Unsupported(String),
}

/// What is too much memory.
pub(crate) const MEMORY: &str = "bytes of memory";

/// What to do about too much of something, where a flag helps.
fn remedy(name: &str) -> &'static str {
    if name == MEMORY { ": --max-memory allows more" } else { "" }
}

impl LoadError {
    pub(crate) fn io(path: &Path, cause: io::Error) -> LoadError {
        LoadError::Io { path: path.to_path_buf(), cause }
    }

    pub(crate) fn parse(place: impl fmt::Display, what: impl fmt::Display) -> LoadError {
        LoadError::Parse { place: place.to_string(), what: what.to_string() }
    }

    pub(crate) fn invalid(place: impl fmt::Display, rule: impl fmt::Display) -> LoadError {
        LoadError::Invalid { place: place.to_string(), rule: rule.to_string() }
    }

    /// `Err(Limit)` where `asked` is more than `allowed`.
    pub(crate) fn check(name: &'static str, asked: u64, allowed: u64) -> Result<(), LoadError> {
        if asked > allowed { Err(LoadError::Limit { name, asked, allowed }) } else { Ok(()) }
    }
}

/// Something in a file that was left out, repaired or replaced. One line.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Warning {
    /// Where in the file: a JSON path, or a line.
    pub place: String,
    /// What was done about what.
    pub what: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.place.is_empty() {
            f.write_str(&self.what)
        } else {
            write!(f, "{}: {}", self.place, self.what)
        }
    }
}

/// Collects warnings, each once.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    list: Vec<Warning>,
    seen: HashSet<Warning>,
}

impl Warnings {
    /// Adds a warning unless the same one is there already.
    pub fn add(&mut self, place: impl fmt::Display, what: impl fmt::Display) {
        self.push(Warning { place: place.to_string(), what: what.to_string() });
    }

    /// Adds what was collected elsewhere.
    pub fn extend(&mut self, other: Warnings) {
        other.list.into_iter().for_each(|w| self.push(w));
    }

    fn push(&mut self, warning: Warning) {
        if self.seen.insert(warning.clone()) {
            self.list.push(warning);
        }
    }

    pub fn into_vec(self) -> Vec<Warning> {
        self.list
    }
}
