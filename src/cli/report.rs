//! `--report FILE.html`: a page with all pictures of a job, their times and warnings.

use std::fs::File;
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use super::console::{is_stdout, print};
use super::job::{Claims, Writer};
use super::work::folder_of;
use crate::output::{Replace, check_writable, escape_html, write_atomically};

/// A page that grows with each picture, in a file without a name, so that memory does not.
pub(super) struct Report {
    path: PathBuf,
    replace: Replace,
    /// Whether a scene is read from the file that it would be.
    refused: bool,
    page: File,
    since: Instant,
    pictures: usize,
    failed: usize,
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
    /// Width and height of a thumbnail, at most.
    pub const SIDE: u32 = 192;

    /// Finds out at once whether it could be written.
    pub fn new(path: &Path, replace: Replace) -> Result<Report> {
        if !is_stdout(path) {
            folder_of(path)?;
            check_writable(path, replace)?;
        }
        let page = tempfile::tempfile()
            .with_context(|| format!("{}: what it is made of needs a passing file", path.display()))?;
        Ok(Report {
            path: path.to_path_buf(),
            replace,
            refused: false,
            page,
            since: Instant::now(),
            pictures: 0,
            failed: 0,
        })
    }

    /// Refuses to write over what a scene is read from, now and in the end.
    pub fn spare(&mut self, claims: &Claims) -> Result<()> {
        claims.spare(&self.path, Writer::Flag("--report")).map_err(|why| {
            self.refused = true;
            Error::msg(why)
        })
    }

    /// A scene is begun.
    pub fn scene(&mut self, scene: &Path) -> Result<()> {
        self.add(&format!("<h2>{}</h2>\n", escape_html(&scene.to_string_lossy())))
    }

    /// A picture was written: `small` is a JPEG of it.
    pub fn picture(&mut self, small: &[u8], file: &Path, took: Duration) -> Result<()> {
        let small = BASE64_STANDARD.encode(small);
        let name = file.file_name().map(|n| n.to_string_lossy()).unwrap_or_default();
        self.pictures += 1;
        self.add(&format!(
            "<figure><a href=\"{}\"><img alt=\"\" src=\"data:image/jpeg;base64,{small}\"></a><figcaption>{} \
             &middot; {:.2} s</figcaption></figure>\n",
            escape_html(&self.link(file)),
            escape_html(&name),
            took.as_secs_f64()
        ))
    }

    /// A scene is done: what was to be said of it.
    pub fn scene_done(&mut self, warnings: &[String], kept: usize, error: Option<&str>) -> Result<()> {
        if kept > 0 {
            let were = if kept == 1 { "picture was" } else { "pictures were" };
            self.add(&format!("<p>{kept} {were} there already.</p>\n"))?;
        }
        for warning in warnings {
            self.add(&format!("<p class=\"warning\">warning: {}</p>\n", escape_html(warning)))?;
        }
        self.failed += usize::from(error.is_some());
        error.map_or(Ok(()), |e| self.add(&format!("<p class=\"failed\">{}</p>\n", escape_html(e))))
    }

    /// Writes the page, unless it was refused and told so, and returns the file that there is then.
    pub fn finish(mut self) -> Result<Option<PathBuf>> {
        if self.refused {
            return Ok(None);
        }
        let Report { pictures, failed, .. } = self;
        let seconds = self.since.elapsed().as_secs_f64();
        let of = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
        let mut page = format!("{HEAD}<p>{} in {seconds:.1} s", of(pictures, "picture"));
        if failed > 0 {
            page += &format!(", <span class=\"failed\">{} failed</span>", of(failed, "scene"));
        }
        page += ".</p>\n";
        self.page.rewind()?;
        self.page.read_to_string(&mut page)?;
        page += "</html>\n";
        if is_stdout(&self.path) {
            return print(page.as_bytes()).map(|()| None);
        }
        write_atomically(&self.path, page.as_bytes(), self.replace)
            .with_context(|| format!("{} cannot be written", self.path.display()))?;
        Ok(Some(self.path))
    }

    fn add(&mut self, html: &str) -> Result<()> {
        self.page.write_all(html.as_bytes()).context("the report cannot be written")
    }

    /// From the page to a file: relative where it lies below the page's folder.
    fn link(&self, file: &Path) -> String {
        let whole = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
        let (page, file) = (whole(&self.path), whole(file));
        let below = page.parent().and_then(|folder| file.strip_prefix(folder).ok());
        let path = below.unwrap_or(&file).to_string_lossy().replace('\\', "/");
        // What would end a path in a link, and what begins an escape.
        path.replace('%', "%25").replace('?', "%3F").replace('#', "%23")
    }
}
