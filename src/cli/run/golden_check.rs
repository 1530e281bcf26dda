//! `render --check`: compares images with golden ones, or writes those.

use std::collections::HashSet;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::progress::{Reporter, SceneLog};
use crate::diff::comparison::{Comparison, Heading};
use crate::diff::text::amount_text;
use crate::diff::{html, images};
use crate::files::create_parent_folder;
use crate::plan::CheckPlan;
use blinn_core::worded;
use blinn_import::Limits;
use blinn_output::{ImageFormat, Overwrite, write_atomically};

/// Images that the error names.
const NAMED: usize = 4;

/// Golden images that stand in the folder of `--check`, and have no scene any more.
#[derive(Default)]
pub struct GoldenNames {
    /// The golden images that a scene has.
    used: HashSet<OsString>,
    /// True if the images of a scene are not known.
    is_partial: bool,
}

impl GoldenNames {
    /// Notes the images of a scene; `None` if they are not known.
    pub fn add(&mut self, images: Option<&[PathBuf]>) {
        match images {
            Some(images) => {
                self.used.extend(images.iter().filter_map(|image| Some(image.file_name()?.into())))
            }
            None => self.is_partial = true,
        }
    }

    /// Returns the images in the folder that no scene of the run has, in the order of their names. Files that are no
    /// images of the output formats are left out.
    pub fn without_scene(&self, plan: &CheckPlan) -> Vec<PathBuf> {
        if self.is_partial {
            return Vec::new();
        }
        let files = fs::read_dir(&plan.folder).into_iter().flatten().flatten();
        let is_unused = |path: &PathBuf| {
            ImageFormat::from_path(path).is_some()
                && path.is_file()
                && !self.used.contains(path.file_name().unwrap_or_default())
        };
        let mut unused: Vec<PathBuf> = files.map(|file| file.path()).filter(is_unused).collect();
        unused.sort();
        unused
    }

    /// Names the images that no scene of the run has.
    pub fn warn(&self, plan: &CheckPlan, reporter: &Reporter) {
        let unused = self.without_scene(plan);
        let Some((last, first)) = unused.split_at(unused.len().min(NAMED)).0.split_last() else { return };
        let what = "no scene of this run has this golden picture; delete it, or add its scene";
        first.iter().for_each(|file| reporter.warn(file, what));
        let more = unused.len() - unused.len().min(NAMED);
        let more = if more > 0 { format!(" (and {more} more)") } else { String::new() };
        reporter.warn(last, &format!("{what}{more}"));
    }
}

/// Compares the images of a scene with the golden ones, or writes those.
///
/// # Errors
/// An image that differs or has no golden one, or a file that cannot be read or written.
pub fn check(plan: &CheckPlan, files: &[PathBuf], limits: &Limits, log: &SceneLog) -> Result<()> {
    if plan.bless {
        return files.iter().try_for_each(|file| bless(plan, file, log));
    }
    let mut problems = Vec::new();
    for file in files {
        problems.extend(problem(plan, file, limits, log)?);
    }
    if problems.is_empty() {
        return Ok(());
    }
    let count = problems.len();
    let more = if count > NAMED { format!("; and {} more", count - NAMED) } else { String::new() };
    problems.truncate(NAMED);
    bail!(worded!("{} of {} images fail `check`: {}{}", count, files.len(), problems.join("; "), more))
}

/// Replaces the golden image.
fn bless(plan: &CheckPlan, file: &Path, log: &SceneLog) -> Result<()> {
    let golden = plan.golden(file);
    let bytes = fs::read(file).with_context(|| format!("{} cannot be read", file.display()))?;
    create_parent_folder(&golden)?;
    write_atomically(&golden, &bytes, Overwrite::Yes)
        .with_context(|| format!("{} cannot be written", golden.display()))?;
    log.wrote(&golden);
    Ok(())
}

/// Returns the difference of an image, after writing a page about it; `None` if it equals the golden one.
fn problem(plan: &CheckPlan, file: &Path, limits: &Limits, log: &SceneLog) -> Result<Option<String>> {
    let golden = plan.golden(file);
    if !golden.exists() {
        return Ok(Some(worded!("{} is missing, `bless` writes it", golden.display())));
    }
    let comparison = images::compare(&golden, file, &plan.compare, limits)?;
    let page = file.with_extension("diff.html");
    if !comparison.is_different() {
        html::remove_page(&page)?;
        return Ok(None);
    }
    let compare = &plan.compare;
    let tolerance = compare.tolerance.unwrap_or(0.0);
    let heading = Heading { old: &golden, new: file, tolerance, flip: compare.flip };
    html::write_page(&page, &heading, &comparison, Overwrite::Yes)?;
    log.wrote(&page);
    Ok(Some(format!(
        "{} differs, {} (see {})",
        file.display(),
        summary(&comparison, compare.flip),
        page.display()
    )))
}

fn summary(comparison: &Comparison, is_flip: bool) -> String {
    match (&comparison.mismatch, comparison.views.first()) {
        (None, Some(view)) => {
            let pixels = if view.summary.changed == 1 { "pixel" } else { "pixels" };
            let comma = if is_flip { "," } else { "" };
            format!("{} {pixels}{comma} {}", view.summary.changed, amount_text(&view.summary, is_flip))
        }
        (mismatch, _) => mismatch.clone().unwrap_or_default(),
    }
}
