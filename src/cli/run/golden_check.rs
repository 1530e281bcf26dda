//! `render --check`: compares images with golden ones, or writes those.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::progress::SceneLog;
use crate::diff::comparison::{Comparison, Heading};
use crate::diff::{html, images};
use crate::files::create_parent_folder;
use crate::plan::CheckPlan;
use blinn_import::Limits;
use blinn_output::{Overwrite, write_atomically};

/// Images that the error names.
const NAMED: usize = 4;

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
        problems.extend(problem(plan, file, limits)?);
    }
    if problems.is_empty() {
        return Ok(());
    }
    let count = problems.len();
    let more = if count > NAMED { format!("; and {} more", count - NAMED) } else { String::new() };
    problems.truncate(NAMED);
    bail!("{count} of {} images fail --check: {}{more}", files.len(), problems.join("; "))
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
fn problem(plan: &CheckPlan, file: &Path, limits: &Limits) -> Result<Option<String>> {
    let golden = plan.golden(file);
    if !golden.exists() {
        return Ok(Some(format!("{} is missing, --bless writes it", golden.display())));
    }
    let comparison = images::compare(&golden, file, &plan.compare, limits)?;
    if !comparison.is_different() {
        return Ok(None);
    }
    let page = file.with_extension("diff.html");
    let compare = &plan.compare;
    let tolerance = compare.tolerance.unwrap_or(0.0);
    let heading = Heading { old: &golden, new: file, tolerance, flip: compare.flip };
    html::write_page(&page, &heading, &comparison, Overwrite::Yes)?;
    Ok(Some(format!("{} differs, {} (see {})", file.display(), summary(&comparison), page.display())))
}

fn summary(comparison: &Comparison) -> String {
    match (&comparison.mismatch, comparison.views.first()) {
        (None, Some(view)) => {
            let pixels = if view.summary.changed == 1 { "pixel" } else { "pixels" };
            format!("{} {pixels} by up to {:.3}", view.summary.changed, view.summary.max)
        }
        (mismatch, _) => mismatch.clone().unwrap_or_default(),
    }
}
