//! `--report FILE.html`: a page with all pictures of a job, their times and warnings.

use std::fs::File;
use std::io::{self, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Error, Result};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use crate::cli::console::{is_stdout, printed};
use crate::cli::plan::{Claims, Writer};
use crate::cli::run::scene_job::folder_of;
use crate::output::{
    Overwrite, SaveError, check_writable, escape_html, unnamed_temp_file, write_atomically_with,
};

/// A page that grows with each picture, in a file without a name, so that memory does not. Where it cannot
/// grow any more it is given up, and the pictures are made all the same.
pub(crate) struct Report {
    path: PathBuf,
    replace: Overwrite,
    /// Whether a scene is read from the file that it would be.
    refused: bool,
    page: BufWriter<File>,
    /// Why it is given up.
    broken: Option<io::Error>,
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
    pub fn new(path: &Path, replace: Overwrite) -> Result<Report> {
        let passing = || format!("{}: what it is made of needs a passing file", path.display());
        let page = if is_stdout(path) {
            tempfile::tempfile().with_context(passing)?
        } else {
            folder_of(path)?;
            check_writable(path, replace)?;
            unnamed_temp_file(path).with_context(passing)?
        };
        Ok(Report {
            path: path.to_path_buf(),
            replace,
            refused: false,
            page: BufWriter::new(page),
            broken: None,
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
    pub fn scene(&mut self, scene: &Path) {
        self.add(&format!("<h2>{}</h2>\n", escape_html(&scene.to_string_lossy())));
    }

    /// A picture was written: `small` is a JPEG of it.
    pub fn picture(&mut self, small: &[u8], file: &Path, took: Duration) {
        let small = BASE64_STANDARD.encode(small);
        let name = file.file_name().map(|n| n.to_string_lossy()).unwrap_or_default();
        self.pictures += 1;
        self.add(&format!(
            "<figure><a href=\"{}\"><img alt=\"\" src=\"data:image/jpeg;base64,{small}\"></a><figcaption>{} \
             &middot; {:.2} s</figcaption></figure>\n",
            escape_html(&self.link(file)),
            escape_html(&name),
            took.as_secs_f64()
        ));
    }

    /// A scene is done: what was to be said of it.
    ///
    /// # Errors
    /// Why the page is given up.
    pub fn scene_done(
        &mut self,
        warnings: &[String],
        kept: usize,
        error: Option<&str>,
    ) -> Result<(), SaveError> {
        if kept > 0 {
            let were = if kept == 1 { "picture was" } else { "pictures were" };
            self.add(&format!("<p>{kept} {were} there already.</p>\n"));
        }
        for warning in warnings {
            self.add(&format!("<p class=\"warning\">warning: {}</p>\n", escape_html(warning)));
        }
        self.failed += usize::from(error.is_some());
        if let Some(e) = error {
            self.add(&format!("<p class=\"failed\">{}</p>\n", escape_html(e)));
        }
        match self.broken.take() {
            Some(cause) => Err(SaveError { path: self.path.clone(), cause }),
            None => Ok(()),
        }
    }

    /// Writes the page, unless it was refused and told so, and returns the file that there is then.
    pub fn finish(self) -> Result<Option<PathBuf>> {
        if self.refused {
            return Ok(None);
        }
        let (pictures, failed) = (self.pictures, self.failed);
        let seconds = self.since.elapsed().as_secs_f64();
        let of = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
        let mut page = format!("{HEAD}<p>{} in {seconds:.1} s", of(pictures, "picture"));
        if failed > 0 {
            page += &format!(", <span class=\"failed\">{} failed</span>", of(failed, "scene"));
        }
        page += ".</p>\n";
        let Report { path, replace, page: body, .. } = self;
        let cannot = || format!("{} cannot be written", path.display());
        let mut body = body.into_inner().map_err(|e| e.into_error()).with_context(cannot)?;
        body.rewind().with_context(cannot)?;
        let mut whole = page.as_bytes().chain(body).chain(&b"</html>\n"[..]);
        if is_stdout(&path) {
            let written = io::copy(&mut whole, &mut io::stdout().lock()).map(drop);
            return printed(written).map(|()| None);
        }
        write_atomically_with(&path, replace, |file| io::copy(&mut whole, file).map(drop))
            .with_context(cannot)?;
        Ok(Some(path))
    }

    fn add(&mut self, html: &str) {
        if self.broken.is_none() {
            self.broken = self.page.write_all(html.as_bytes()).err();
        }
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
