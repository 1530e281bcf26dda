//! Reads and writes result files: a JSON object.

use std::path::Path;

use serde::Deserialize;

use super::results::{BenchResults, FORMAT};

/// Larger files are not read.
const MAX_BYTES: u64 = 256 << 20;

/// How to create a results file, for messages.
const HINT: &str = "create a file with: blinn bench SCENE --json FILE";

impl BenchResults {
    /// The text of a results file.
    pub fn to_json(&self) -> String {
        // Fails only for maps whose keys are not strings; there are none.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Reads a results file.
    ///
    /// # Errors
    /// The file cannot be read, or is not a results file.
    pub fn read(path: &Path) -> Result<BenchResults, ResultsError> {
        let error = |message: String| ResultsError { file: path.display().to_string(), message };
        let length = std::fs::metadata(path).map_err(|e| error(e.to_string()))?.len();
        if length > MAX_BYTES {
            return Err(error(format!("{length} bytes are too many for a results file of 'blinn bench'")));
        }
        let text = std::fs::read(path).map_err(|e| error(e.to_string()))?;
        BenchResults::parse(&text).map_err(error)
    }

    /// Parses the text of a results file.
    ///
    /// # Errors
    /// The text is not JSON, not of this format, or a value has the wrong type.
    pub fn parse(text: &[u8]) -> Result<BenchResults, String> {
        /// The part that identifies the format.
        #[derive(Deserialize)]
        struct Header {
            format: String,
        }
        let invalid = |e: serde_json::Error| match e.classify() {
            serde_json::error::Category::Data => format!("not a results file of 'blinn bench' ({HINT})"),
            _ => format!("{e}: the file is damaged or not JSON ({HINT})"),
        };
        let header: Header = serde_json::from_slice(text).map_err(invalid)?;
        if header.format != FORMAT {
            let format: String = header.format.chars().take(40).collect();
            return Err(format!("the format is '{format}', not '{FORMAT}' ({HINT})"));
        }
        let mut json = serde_json::Deserializer::from_slice(text);
        serde_path_to_error::deserialize(&mut json).map_err(|e| format!("at {}: {}", e.path(), e.inner()))
    }
}

/// A results file that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {message}")]
pub struct ResultsError {
    file: String,
    message: String,
}
