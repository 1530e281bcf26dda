//! Names of the pages and pictures of pairs.

use std::path::{Path, PathBuf, is_separator};

use super::check_page_format;
use crate::plan::split_existing_folder;
use crate::usage::UsageError;
use blinn_session::{PathTemplate, TemplateFields};

/// Where the pages of pairs are written.
pub enum PageNames {
    /// A folder with HTML pages, whose names are the relative paths of the old files with another extension.
    Folder(PathBuf),
    /// Names with placeholders for the old file.
    Template(PathTemplate),
}

impl PageNames {
    /// Parses the value of -o. A folder exists, ends in a slash, or has no extension.
    ///
    /// # Errors
    /// A format that is not written, or a placeholder that pairs do not have.
    pub fn new(output: &Path) -> Result<PageNames, UsageError> {
        let Some(text) = output.to_str() else {
            return Err(UsageError(format!("-o {}: the name must be UTF-8", output.display())));
        };
        let is_literal = PathTemplate::parse(text).is_literal();
        let is_new_folder = is_literal && output.extension().is_none();
        if output.is_dir() || is_literal && text.ends_with(is_separator) || is_new_folder {
            return Ok(PageNames::Folder(output.to_path_buf()));
        }
        check_page_format(output)?;
        let (folder, name) = split_existing_folder(text);
        let template = PathTemplate::in_folder(folder, name);
        let has_others = template.has_frame_number() || template.has_camera() || template.has_shard_number();
        if has_others || PathTemplate::unknown_placeholder(name).is_some() {
            return Err(UsageError(format!(
                "-o {text}: the placeholders of diff are {{stem}}, {{ext}}, {{parent}} and {{index}}"
            )));
        }
        Ok(PageNames::Template(template))
    }

    /// The page of a pair: `old` is the old file, `name` its path relative to its folder, and `index` the number of the
    /// pair, from 1.
    pub fn page(&self, old: &Path, name: &Path, index: usize) -> PathBuf {
        match self {
            PageNames::Folder(folder) => folder.join(name.with_extension("html")),
            PageNames::Template(template) => {
                template.expand(&TemplateFields { scene: old, index, frame: 0, camera: "", shard: 0 })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(output: &str) -> Result<PathBuf, String> {
        let names = PageNames::new(Path::new(output)).map_err(|error| error.0)?;
        Ok(names.page(Path::new("rev1/sub/hinge.v2.stl"), Path::new("sub/hinge.v2.stl"), 3))
    }

    #[test]
    fn pages_are_named_after_the_old_files() {
        for (output, expected) in [
            ("none/", "none/sub/hinge.v2.html"),
            ("none", "none/sub/hinge.v2.html"),
            ("none/{stem}.png", "none/hinge.v2.png"),
            ("{parent}/{index:03}_{stem}.{ext}.html", "sub/003_hinge.v2.stl.html"),
        ] {
            assert_eq!(page(output).unwrap(), Path::new(expected), "{output}");
        }
        assert!(page("none/{stem}.gif").unwrap_err().contains("use .html or .png"));
        for output in ["{stem}_{name}.html", "{stem}_{camera}.html", "{stem}_####.png"] {
            assert!(page(output).unwrap_err().contains("placeholders of diff"), "{output}");
        }
    }
}
