//! The files that scenes of a dataset have in common, made of files of each scene.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use serde_json::{Map, Value};

use super::progress::Reporter;
use crate::files::create_parent_folder;
use blinn_core::worded;
use blinn_output::{Overwrite, SaveError, write_atomically_with};

/// Writes a file and returns its path, or `None` if --no-overwrite keeps one with the same content.
///
/// # Errors
/// The file cannot be written, or exists with other content and must not be overwritten.
pub fn write_common_file(
    file: &Path,
    replace: Overwrite,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<Option<PathBuf>> {
    if replace == Overwrite::No && file.exists() {
        let mut bytes = Vec::new();
        write(&mut bytes).with_context(|| format!("{} cannot be merged", file.display()))?;
        if fs::read(file).is_ok_and(|known| known == bytes) {
            return Ok(None);
        }
        bail!(worded!(
            "{} exists, and `no-overwrite` keeps it; run again with `resume` instead",
            file.display()
        ));
    }
    create_parent_folder(file)?;
    let written = write_atomically_with(file, replace, |target| {
        let mut out = BufWriter::new(target);
        write(&mut out)?;
        out.flush()
    });
    written.map_err(|cause| SaveError { path: file.to_path_buf(), cause })?;
    Ok(Some(file.to_path_buf()))
}

/// Returns the text of BOP's extents of models, from those of each scene. Scenes may share models.
///
/// # Errors
/// A file cannot be read, or blinn did not write it, or two models have one number.
pub fn merge_models_info<'p>(scenes: impl Iterator<Item = &'p Path>) -> Result<String> {
    let mut models: BTreeMap<u64, Value> = BTreeMap::new();
    for path in scenes {
        let info: Map<String, Value> = serde_json::from_str(&read_text(path)?)
            .with_context(|| format!("{} cannot be merged", path.display()))?;
        for (object, value) in info {
            let number = object.parse().with_context(|| format!("{}: \"{object}\"", path.display()))?;
            if models.get(&number).is_some_and(|known| *known != value) {
                bail!(
                    "{}: model {number} has other extents in another scene; render all scenes again",
                    path.display()
                );
            }
            models.insert(number, value);
        }
    }
    let lines: Vec<String> = models.iter().map(|(number, info)| format!("  \"{number}\": {info}")).collect();
    Ok(format!("{{\n{}\n}}\n", lines.join(",\n")))
}

/// Warns that a file lacks `missing` of `count` scenes, if it does.
pub fn warn_of_missing(reporter: &Reporter, file: &Path, missing: usize, count: usize) {
    if missing > 0 {
        let text = worded!(
            "{} of {} scenes are missing: they failed, or other shares have not rendered them; `resume` adds them",
            missing,
            count
        );
        reporter.warn(file, &text);
    }
}

/// Reads a file.
///
/// # Errors
/// It cannot be read, or is not UTF-8.
pub fn read_text(file: &Path) -> Result<String> {
    fs::read_to_string(file).with_context(|| format!("{} cannot be read", file.display()))
}
