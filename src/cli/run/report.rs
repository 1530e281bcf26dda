//! `--report FILE.html`: a page with all images, their render times and warnings.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};

use super::report_section::SectionContent;
use crate::console::{finish_stdout, is_stdout};
use crate::files::create_parent_folder;
use crate::plural::plural;
use blinn_output::{
    Overwrite, PAGE_STYLE, SaveError, check_writable, escape_html, unnamed_temp_file, write_atomically_with,
};

/// Maximum width and height of a thumbnail in pixels.
pub const THUMBNAIL_SIDE: u32 = 192;

/// A page that grows with each scene, in an unnamed temporary file so that memory does not grow. If writing fails,
/// the page is given up and images are still rendered.
pub struct Report {
    path: PathBuf,
    replace: Overwrite,
    /// True if the page would overwrite an input. It is not written then.
    overwrites_input: bool,
    body: BufWriter<File>,
    since: Instant,
    images: usize,
    scenes: usize,
    failures: usize,
    /// Scenes with warnings.
    warned: usize,
}

/// The page, with placeholders for its totals and the sections of its scenes.
const PAGE: &str = include_str!("report.html");

impl Report {
    /// Starts a page.
    ///
    /// # Errors
    /// The page could not be written at `path`.
    pub fn new(path: &Path, replace: Overwrite) -> Result<Report> {
        let no_temporary = || format!("{}: no temporary file could be created", path.display());
        let body = if is_stdout(path) {
            tempfile::tempfile().with_context(no_temporary)?
        } else {
            create_parent_folder(path)?;
            check_writable(path, replace)?;
            unnamed_temp_file(path).with_context(no_temporary)?
        };
        Ok(Report {
            path: path.to_path_buf(),
            replace,
            overwrites_input: false,
            body: BufWriter::new(body),
            since: Instant::now(),
            images: 0,
            scenes: 0,
            failures: 0,
            warned: 0,
        })
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds the section of a scene, with its warnings, the number of images kept by --resume and its error.
    ///
    /// # Errors
    /// The write error for which the page is given up.
    pub fn add_scene(
        &mut self,
        scene: &Path,
        content: SectionContent,
        warnings: &[String],
        kept: usize,
        error: Option<&str>,
    ) -> Result<(), SaveError> {
        self.overwrites_input |= content.overwrites_input;
        let has_warnings = !warnings.is_empty() || content.has_empty_images;
        self.images += content.images;
        self.scenes += 1;
        self.failures += usize::from(error.is_some());
        self.warned += usize::from(has_warnings);
        let mut class = String::from("card scene");
        for (applies, name) in
            [(content.images > 1, " whole"), (error.is_some(), " failed"), (has_warnings, " warned")]
        {
            class += if applies { name } else { "" };
        }
        let mut end = String::from("</div>\n");
        if kept > 0 {
            end += &format!("<p>{} kept.</p>\n", plural(kept as u64, "image"));
        }
        for warning in warnings {
            end += &format!("<p class=\"caution\">warning: {}</p>\n", escape_html(warning));
        }
        if let Some(e) = error {
            end += &format!("<p class=\"bad\">{}</p>\n", escape_html(e));
        }
        end += "</section>\n";
        let name = escape_html(&scene.to_string_lossy());
        let heading = format!("<section class=\"{class}\">\n<h2>{name}</h2>\n<div class=\"grid\">\n");
        let written = content.html.and_then(|html| {
            let mut section = heading.as_bytes().chain(html).chain(end.as_bytes());
            io::copy(&mut section, &mut self.body).map(drop)
        });
        written.map_err(|cause| SaveError { path: self.path.clone(), cause })
    }

    /// Writes the page. Returns its path, or `None` if it went to standard output or would overwrite an input.
    pub fn finish(self) -> Result<Option<PathBuf>> {
        if self.overwrites_input {
            return Ok(None);
        }
        let (head, tail) = self.frame();
        let Report { path, replace, body, .. } = self;
        let cannot_be_written = || format!("{} cannot be written", path.display());
        let mut body = body.into_inner().map_err(|e| e.into_error()).with_context(cannot_be_written)?;
        body.rewind().with_context(cannot_be_written)?;
        let mut page = head.as_bytes().chain(body).chain(tail.as_bytes());
        if is_stdout(&path) {
            let written = io::copy(&mut page, &mut io::stdout().lock()).map(drop);
            return finish_stdout(written).map(|()| None);
        }
        write_atomically_with(&path, replace, |file| io::copy(&mut page, file).map(drop))
            .with_context(cannot_be_written)?;
        Ok(Some(path))
    }

    /// The page before and after the sections.
    fn frame(&self) -> (String, &'static str) {
        let seconds = self.since.elapsed().as_secs_f64();
        let mut facts = format!("{} in {seconds:.1} s", plural(self.images as u64, "image"));
        if self.failures > 0 {
            facts +=
                &format!(", <span class=\"bad\">{} failed</span>", plural(self.failures as u64, "scene"));
        }
        if self.warned > 0 {
            let scenes = plural(self.warned as u64, "scene");
            facts += &format!(", <span class=\"caution\">{scenes} with warnings</span>");
        }
        let disabled = |count: usize| if count == 0 { " disabled" } else { "" }.to_string();
        let (head, tail) = PAGE.split_once("{{body}}").unwrap_or((PAGE, ""));
        let values = [
            ("{{title}}", format!("blinn: {}", plural(self.scenes as u64, "scene"))),
            ("{{style}}", PAGE_STYLE.into()),
            ("{{facts}}", facts + "."),
            ("{{all}}", self.scenes.to_string()),
            ("{{failed}}", self.failures.to_string()),
            ("{{warned}}", self.warned.to_string()),
            ("{{no-failed}}", disabled(self.failures)),
            ("{{no-warned}}", disabled(self.warned)),
        ];
        (values.iter().fold(head.to_string(), |page, (name, value)| page.replace(name, value)), tail)
    }
}
