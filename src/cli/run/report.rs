//! `--report FILE.html`: a page with all images, their render times and warnings.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};

use super::report_section::SectionContent;
use crate::console::{finish_stdout, is_stdout};
use crate::files::create_parent_folder;
use blinn_output::{
    Overwrite, SaveError, check_writable, escape_html, unnamed_temp_file, write_atomically_with,
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
    failures: usize,
}

const HEAD: &str = "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>blinn</title>\n<style>\n\
body { font: 14px/1.4 sans-serif; margin: 2em; background: #fff; color: #222 }\n\
h2 { font-size: 1em; margin: 2em 0 .5em; overflow-wrap: anywhere }\n\
figure { display: inline-block; vertical-align: top; margin: 0 .75em .75em 0; max-width: 192px }\n\
figcaption { font-size: 12px; color: #555; overflow-wrap: anywhere }\n\
img { display: block; border: 1px solid #ccc }\n\
.warning { color: #8a5a00 } .failed { color: #b00020 }\n\
</style>\n";

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
            failures: 0,
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
        self.images += content.images;
        self.failures += usize::from(error.is_some());
        let mut end = String::new();
        if kept > 0 {
            let images = if kept == 1 { "image" } else { "images" };
            end += &format!("<p>{kept} {images} kept.</p>\n");
        }
        for warning in warnings {
            end += &format!("<p class=\"warning\">warning: {}</p>\n", escape_html(warning));
        }
        if let Some(e) = error {
            end += &format!("<p class=\"failed\">{}</p>\n", escape_html(e));
        }
        let heading = format!("<h2>{}</h2>\n", escape_html(&scene.to_string_lossy()));
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
        let head = self.head();
        let Report { path, replace, body, .. } = self;
        let cannot_be_written = || format!("{} cannot be written", path.display());
        let mut body = body.into_inner().map_err(|e| e.into_error()).with_context(cannot_be_written)?;
        body.rewind().with_context(cannot_be_written)?;
        let mut page = head.as_bytes().chain(body).chain(&b"</html>\n"[..]);
        if is_stdout(&path) {
            let written = io::copy(&mut page, &mut io::stdout().lock()).map(drop);
            return finish_stdout(written).map(|()| None);
        }
        write_atomically_with(&path, replace, |file| io::copy(&mut page, file).map(drop))
            .with_context(cannot_be_written)?;
        Ok(Some(path))
    }

    /// Style sheet and totals.
    fn head(&self) -> String {
        let plural =
            |count: usize, noun: &str| format!("{count} {noun}{}", if count == 1 { "" } else { "s" });
        let seconds = self.since.elapsed().as_secs_f64();
        let mut head = format!("{HEAD}<p>{} in {seconds:.1} s", plural(self.images, "image"));
        if self.failures > 0 {
            head += &format!(", <span class=\"failed\">{} failed</span>", plural(self.failures, "scene"));
        }
        head + ".</p>\n"
    }
}
