//! What the program tells on standard error while it works.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use super::args::ProgressArg;
use super::one_line;
use crate::render::Watch;

/// Tells of scenes, files and warnings in the way that was asked for.
pub(super) struct Reporter {
    style: Style,
    quiet: bool,
    verbose: bool,
    perf: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Style {
    Bar,
    Plain,
    Json,
    None,
}

impl Reporter {
    pub fn new(progress: ProgressArg, quiet: bool, verbose: bool, perf: bool) -> Reporter {
        let style = match progress {
            _ if quiet => Style::None,
            ProgressArg::Auto if std::io::stderr().is_terminal() => Style::Bar,
            ProgressArg::Plain => Style::Plain,
            ProgressArg::Json => Style::Json,
            ProgressArg::Auto | ProgressArg::None => Style::None,
        };
        Reporter { style, quiet, verbose, perf }
    }

    /// A warning, in one line.
    pub fn warn(&self, scene: &Path, text: &str) {
        if self.quiet {
            return;
        }
        let text = one_line(text);
        match self.style {
            Style::Json => self.json(serde_json::json!({
                "event": "warning", "scene": scene.to_string_lossy(), "text": text
            })),
            _ => eprintln!("warning: {}: {text}", scene.display()),
        }
    }

    /// Something that was chosen.
    pub fn note(&self, text: &str) {
        if self.verbose && !self.quiet {
            eprintln!("{}", one_line(text));
        }
    }

    /// A stage's time, for `--perf`.
    pub fn stage(&self, name: &str, since: Instant, what: &str) {
        if self.perf {
            eprintln!("perf: {name:<8} {:>10.1} ms  {what}", since.elapsed().as_secs_f64() * 1e3);
        }
    }

    /// A file that was written.
    pub fn wrote(&self, path: &Path) {
        match self.style {
            _ if self.quiet => {}
            Style::Json => self.json(serde_json::json!({"event": "wrote", "file": path.to_string_lossy()})),
            _ => eprintln!("wrote {}", path.display()),
        }
    }

    /// Watches the render of a picture of so many pixels.
    pub fn watch(&self, scene: &Path, pixels: u64) -> PixelWatch<'_> {
        let bar = (self.style == Style::Bar).then(|| {
            let bar = ProgressBar::new(pixels);
            let style = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %  {elapsed} +{eta}");
            if let Ok(style) = style {
                bar.set_style(style);
            }
            bar.set_message(scene.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default());
            bar
        });
        PixelWatch {
            reporter: self,
            bar,
            pixels,
            done: AtomicU64::new(0),
            scene: scene.display().to_string(),
        }
    }

    fn json(&self, event: serde_json::Value) {
        eprintln!("{event}");
    }
}

/// Watches one picture.
pub(super) struct PixelWatch<'r> {
    reporter: &'r Reporter,
    bar: Option<ProgressBar>,
    pixels: u64,
    done: AtomicU64,
    scene: String,
}

impl Watch for PixelWatch<'_> {
    fn pixels_done(&self, count: u64) {
        if let Some(bar) = &self.bar {
            bar.inc(count);
            return;
        }
        if !matches!(self.reporter.style, Style::Plain | Style::Json) {
            return;
        }
        // A line for every tenth that is passed.
        let before = self.done.fetch_add(count, Ordering::Relaxed);
        let tenth = |done: u64| done * 10 / self.pixels.max(1);
        let now = tenth(before + count);
        if now > tenth(before) {
            match self.reporter.style {
                Style::Json => self.reporter.json(serde_json::json!({
                    "event": "progress", "scene": self.scene, "percent": now * 10
                })),
                _ => eprintln!("{}: {} %", self.scene, now * 10),
            }
        }
    }
}

impl Drop for PixelWatch<'_> {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
