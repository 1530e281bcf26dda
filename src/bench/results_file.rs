//! Reads and writes result files: a JSON object. Files of version 1 are read as well.

use std::path::Path;

use serde::Deserialize;

use super::limited_file::read_limited;
use super::results::{BenchResults, FORMAT};

/// The version before, which had one size of images for all stages.
const FORMAT_1: &str = "blinn bench 1";

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

    /// Reads a results file, or a pipe of one.
    ///
    /// # Errors
    /// The file cannot be read, or is not a results file.
    pub fn read(path: &Path) -> Result<BenchResults, ResultsError> {
        let error = |message: String| ResultsError { file: path.display().to_string(), message };
        let text = read_limited(path, MAX_BYTES, "a results file of 'blinn bench'").map_err(error)?;
        BenchResults::parse(&text).map_err(error)
    }

    /// Parses the text of a results file.
    ///
    /// # Errors
    /// The text is not JSON, not of this format, or a value has the wrong type.
    pub fn parse(text: &[u8]) -> Result<BenchResults, String> {
        /// The part that identifies the format, and the size of images in version 1.
        #[derive(Deserialize)]
        struct Header {
            format: String,
            #[serde(default)]
            settings: SizeV1,
        }
        #[derive(Default, Deserialize)]
        #[serde(default)]
        struct SizeV1 {
            width: Option<u32>,
            height: Option<u32>,
        }
        let invalid = |e: serde_json::Error| match e.classify() {
            serde_json::error::Category::Data => format!("not a results file of 'blinn bench' ({HINT})"),
            _ => format!("{e}: the file is damaged or not JSON ({HINT})"),
        };
        let header: Header = serde_json::from_slice(text).map_err(invalid)?;
        if header.format != FORMAT && header.format != FORMAT_1 {
            let format: String = header.format.chars().take(40).collect();
            return Err(format!("the format is '{format}', not '{FORMAT}' ({HINT})"));
        }
        let mut json = serde_json::Deserializer::from_slice(text);
        let mut results: BenchResults = serde_path_to_error::deserialize(&mut json)
            .map_err(|e| format!("at {}: {}", e.path(), e.inner()))?;
        if header.format == FORMAT_1 {
            results.upgrade(header.settings.width.zip(header.settings.height));
        }
        Ok(results)
    }

    /// Turns results of version 1 into those of this version: all stages had the same `size`.
    fn upgrade(&mut self, size: Option<(u32, u32)>) {
        self.format = FORMAT.into();
        self.settings.sizes = size.map(|(width, height)| [width, height]).into_iter().collect();
        for stage in self.scenes.iter_mut().flat_map(|scene| &mut scene.stages) {
            (stage.width, stage.height) = size.filter(|_| stage.stage.has_size()).unzip();
        }
    }
}

/// A results file that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {message}")]
pub struct ResultsError {
    file: String,
    message: String,
}
