//! `--report FILE.html`: a page with all images, their render times and warnings.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use crate::console::{finish_stdout, is_stdout};
use crate::files::create_parent_folder;
use crate::plan::{PathConflicts, Writer};
use blinn_output::{
    Overwrite, SaveError, check_writable, escape_html, unnamed_temp_file, write_atomically_with,
};

/// Maximum width and height of a thumbnail in pixels.
pub const THUMBNAIL_SIDE: u32 = 192;

/// A page that grows with each image, in an unnamed temporary file so that memory does not grow. If writing fails,
/// the page is given up and images are still rendered.
pub struct Report {
    path: PathBuf,
    replace: Overwrite,
    /// True if the page would overwrite an input. It is not written then.
    overwrites_input: bool,
    body: BufWriter<File>,
    /// The first write error.
    error: Option<io::Error>,
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
            error: None,
            since: Instant::now(),
            images: 0,
            failures: 0,
        })
    }

    /// Returns an error if the page would overwrite an input, and does not write it then.
    pub fn check_not_input(&mut self, paths: &PathConflicts) -> Result<()> {
        paths.check_not_input(&self.path, Writer::Flag("--report")).map_err(|text| {
            self.overwrites_input = true;
            Error::msg(text)
        })
    }

    /// Begins the section of a scene.
    pub fn begin_scene(&mut self, scene: &Path) {
        self.add(&format!("<h2>{}</h2>\n", escape_html(&scene.to_string_lossy())));
    }

    /// Adds an image that was written to `file`. `thumbnail` is a JPEG. Marks an image that shows nothing.
    pub fn add_image(&mut self, thumbnail: &[u8], file: &Path, render_time: Duration, is_empty: bool) {
        let mark = if is_empty { " &middot; <span class=\"warning\">empty</span>" } else { "" };
        let thumbnail = BASE64_STANDARD.encode(thumbnail);
        let name = file.file_name().map(|n| n.to_string_lossy()).unwrap_or_default();
        self.images += 1;
        self.add(&format!(
            "<figure><a href=\"{}\"><img alt=\"\" src=\"data:image/jpeg;base64,{thumbnail}\"></a><figcaption>{} \
             &middot; {:.2} s{mark}</figcaption></figure>\n",
            escape_html(&self.link(file)),
            escape_html(&name),
            render_time.as_secs_f64()
        ));
    }

    /// Ends the section of a scene with its warnings, the number of images kept by --resume and its error.
    ///
    /// # Errors
    /// The write error for which the page is given up.
    pub fn end_scene(
        &mut self,
        warnings: &[String],
        kept: usize,
        error: Option<&str>,
    ) -> Result<(), SaveError> {
        if kept > 0 {
            let images = if kept == 1 { "image" } else { "images" };
            self.add(&format!("<p>{kept} {images} kept.</p>\n"));
        }
        for warning in warnings {
            self.add(&format!("<p class=\"warning\">warning: {}</p>\n", escape_html(warning)));
        }
        self.failures += usize::from(error.is_some());
        if let Some(e) = error {
            self.add(&format!("<p class=\"failed\">{}</p>\n", escape_html(e)));
        }
        match self.error.take() {
            Some(cause) => Err(SaveError { path: self.path.clone(), cause }),
            None => Ok(()),
        }
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

    fn add(&mut self, html: &str) {
        if self.error.is_none() {
            self.error = self.body.write_all(html.as_bytes()).err();
        }
    }

    /// The URL of a file: relative if it is below the page's folder.
    fn link(&self, file: &Path) -> String {
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let page = absolute(&self.path);
        let file = absolute(file);
        let relative = page.parent().and_then(|folder| file.strip_prefix(folder).ok());
        let path = relative.unwrap_or(&file).to_string_lossy().replace('\\', "/");
        path.replace('%', "%25").replace('?', "%3F").replace('#', "%23")
    }
}
