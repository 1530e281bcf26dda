//! The images of a scene on the page of `--report`.

use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Error, Result};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use tempfile::SpooledTempFile;

use crate::plan::{PathConflicts, Writer};
use blinn_output::escape_html;

/// Bytes of a section that are kept in memory; a larger one is kept in an unnamed temporary file.
const MEMORY: usize = 1 << 18;

/// The images of a scene, as HTML.
pub struct ReportSection {
    page: PathBuf,
    body: SpooledTempFile,
    images: usize,
    has_empty_images: bool,
    /// The first write error.
    error: Option<io::Error>,
    /// True if the page would overwrite an input of the scene.
    overwrites_input: bool,
}

/// The content of a section.
pub struct SectionContent {
    pub html: io::Result<SpooledTempFile>,
    pub images: usize,
    /// True if one of them shows nothing.
    pub has_empty_images: bool,
    pub overwrites_input: bool,
}

impl ReportSection {
    /// Starts a section of a page.
    pub fn new(page: &Path) -> ReportSection {
        ReportSection {
            page: page.to_path_buf(),
            body: SpooledTempFile::new(MEMORY),
            images: 0,
            has_empty_images: false,
            error: None,
            overwrites_input: false,
        }
    }

    /// Returns an error if the page would overwrite an input, and marks it then.
    pub fn check_not_input(&mut self, paths: &PathConflicts) -> Result<()> {
        paths.check_not_input(&self.page, Writer::Option("report")).map_err(|text| {
            self.overwrites_input = true;
            Error::msg(text)
        })
    }

    /// Adds an image that was written to `file`. `thumbnail` is a JPEG. Marks an image that shows nothing.
    pub fn add_image(&mut self, thumbnail: &[u8], file: &Path, render_time: Duration, is_empty: bool) {
        let mark = if is_empty { " &middot; <span class=\"caution\">empty</span>" } else { "" };
        let thumbnail = BASE64_STANDARD.encode(thumbnail);
        let name = file.file_name().map(|n| n.to_string_lossy()).unwrap_or_default();
        self.images += 1;
        self.has_empty_images |= is_empty;
        let html = format!(
            "<figure><a href=\"{}\"><img alt=\"{}\" loading=\"lazy\" src=\"data:image/jpeg;base64,{thumbnail}\"></a><figcaption>{} \
             &middot; {:.2} s{mark}</figcaption></figure>\n",
            escape_html(&self.link(file)),
            escape_html(&name),
            escape_html(&name),
            render_time.as_secs_f64()
        );
        if self.error.is_none() {
            self.error = self.body.write_all(html.as_bytes()).err();
        }
    }

    /// Ends the section.
    pub fn finish(mut self) -> SectionContent {
        let html = match self.error {
            Some(error) => Err(error),
            None => self.body.rewind().map(|()| self.body),
        };
        SectionContent {
            html,
            images: self.images,
            has_empty_images: self.has_empty_images,
            overwrites_input: self.overwrites_input,
        }
    }

    /// The URL of a file: relative if it is below the page's folder.
    fn link(&self, file: &Path) -> String {
        let absolute = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let page = absolute(&self.page);
        let file = absolute(file);
        let relative = page.parent().and_then(|folder| file.strip_prefix(folder).ok());
        let path = relative.unwrap_or(&file).to_string_lossy().replace('\\', "/");
        let url = path.replace('%', "%25").replace('?', "%3F").replace('#', "%23");
        // `a:b.png` would be a URL of the scheme `a`.
        if relative.is_some() { format!("./{url}") } else { url }
    }
}
