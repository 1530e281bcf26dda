//! Golden images: where they are, and how others are compared with them.

use std::collections::HashMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::outputs::{OutputKind, Outputs};
use crate::args::{CheckArgs, CompareArgs};
use crate::usage::UsageError;
use blinn_core::worded;
use blinn_output::canonical_path;

/// Compares images with those in a folder, or writes them there.
#[derive(Clone, Debug)]
pub struct CheckPlan {
    pub folder: PathBuf,
    /// True to write the golden images.
    pub bless: bool,
    pub compare: CompareArgs,
}

impl CheckPlan {
    /// Resolves `--check`.
    pub fn from_args(args: &CheckArgs, outputs: &Outputs) -> Result<Option<CheckPlan>, UsageError> {
        let Some(folder) = args.check.clone() else { return Ok(None) };
        if matches!(outputs.kind, OutputKind::Animation(_)) || outputs.is_stdout() {
            return Err(UsageError(worded!(
                "`check` compares image files; set `output` to .png, .exr, .jpg or .webp"
            )));
        }
        Ok(Some(CheckPlan { folder, bless: args.bless, compare: args.compare() }))
    }

    /// The golden image of an image.
    pub fn golden(&self, image: &Path) -> PathBuf {
        self.folder.join(image.file_name().unwrap_or_default())
    }

    /// Checks that no two images have one golden image, and that none is its own.
    pub fn check_names(&self, images: &[PathBuf]) -> Result<(), UsageError> {
        let mut by_name: HashMap<&OsStr, &Path> = HashMap::new();
        for image in images {
            if canonical_path(&self.golden(image)) == canonical_path(image) {
                let folder = self.folder.display();
                return Err(UsageError(worded!(
                    "`check` {}: the images are written to this folder, too; set `output` to another",
                    folder
                )));
            }
            if let Some(other) = by_name.insert(image.file_name().unwrap_or_default(), image) {
                let (image, other) = (image.display(), other.display());
                return Err(UsageError(worded!(
                    "`check`: {} and {} have the same name; use {{stem}}, {{parent}} or {{index}} in it",
                    other,
                    image
                )));
            }
        }
        Ok(())
    }
}
