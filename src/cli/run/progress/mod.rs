//! What the program tells on standard error while it works.

mod tally;
mod teller;

use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use crate::cli::args::{ProgressArg, TellArgs};
use crate::cli::console::tell;
use crate::cli::{Summary, one_line};
use crate::render::ProgressMonitor;
use tally::Tally;

pub(crate) use teller::Teller;

/// Tells of scenes, frames, files and warnings in the way that was asked for.
pub(crate) struct Reporter {
    style: Style,
    quiet: bool,
    verbose: bool,
    perf: bool,
    bar: Option<ProgressBar>,
    tally: Mutex<Tally>,
    /// Steps of progress that were told.
    told: AtomicU64,
    /// Files that were written, and pictures that were there already.
    wrote: AtomicU64,
    kept: AtomicU64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Style {
    Bar,
    Plain,
    Json,
    OpenJd,
    None,
}

/// Whether words that could not be read ask for what an Open Job Description's engine listens to.
pub(crate) fn is_for_openjd(words: &[OsString]) -> bool {
    words.iter().any(|w| w == "--progress=openjd")
        || words.windows(2).any(|w| w[0] == "--progress" && w[1] == "openjd")
}

/// The bar's length.
const BAR: u64 = 10_000;

impl Reporter {
    pub fn new(telling: &TellArgs, scenes: usize, quiet: bool) -> Reporter {
        let style = match telling.progress {
            _ if quiet => Style::None,
            ProgressArg::Auto if std::io::stderr().is_terminal() => Style::Bar,
            ProgressArg::Plain => Style::Plain,
            ProgressArg::Json => Style::Json,
            ProgressArg::Openjd => Style::OpenJd,
            ProgressArg::Auto | ProgressArg::None => Style::None,
        };
        let bar = (style == Style::Bar).then(bar);
        let tally = Mutex::new(Tally::new(scenes));
        Reporter {
            style,
            quiet,
            verbose: telling.verbose,
            perf: telling.perf,
            bar,
            tally,
            told: AtomicU64::new(0),
            wrote: AtomicU64::new(0),
            kept: AtomicU64::new(0),
        }
    }

    /// A line on standard error, above the bar if there is one.
    fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| tell(text)),
            None => tell(text),
        }
    }

    /// A line for people, whom programs that read events tell by how it begins.
    fn remark(&self, text: &str) {
        match self.style {
            Style::Json => self.line(&format!("blinn: {text}")),
            _ => self.line(text),
        }
    }

    fn json(&self, event: serde_json::Value) {
        self.line(&event.to_string());
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
            _ => self.line(&format!("warning: {}: {text}", scene.display())),
        }
    }

    /// A failure, of a scene if it is of one, in one line for people, however quiet; and in the words of
    /// whoever else listens.
    pub fn fail(&self, scene: Option<&Path>, line: &str) {
        match self.style {
            Style::OpenJd => self.line(&format!("openjd_fail: {line}")),
            Style::Json => self.json(serde_json::json!({
                "event": "failed", "scene": scene.map(Path::to_string_lossy), "text": line
            })),
            _ => {}
        }
        self.line(&format!("blinn: {line}"));
    }

    /// Something that was chosen.
    pub fn note(&self, text: &str) {
        if self.verbose && !self.quiet {
            self.remark(&one_line(text));
        }
    }

    /// A stage's time, for `--perf`.
    pub fn stage(&self, name: &str, since: Instant, what: &str) {
        self.perf(&format!("{name:<8} {:>10.1} ms  {what}", since.elapsed().as_secs_f64() * 1e3));
    }

    /// Another line for `--perf`.
    pub fn perf(&self, text: &str) {
        if self.perf {
            self.remark(&format!("perf: {text}"));
        }
    }

    /// A file that was written, for a scene if it is for one.
    pub fn wrote(&self, scene: Option<&Path>, path: &Path) {
        self.wrote.fetch_add(1, Ordering::Relaxed);
        match self.style {
            _ if self.quiet => {}
            Style::Json => self.json(serde_json::json!({
                "event": "wrote", "scene": scene.map(Path::to_string_lossy), "file": path.to_string_lossy()
            })),
            _ => self.line(&format!("wrote {}", path.display())),
        }
    }

    /// Pictures that were there already.
    pub fn kept(&self, scene: &Path, count: usize) {
        self.kept.fetch_add(count as u64, Ordering::Relaxed);
        match self.style {
            _ if self.quiet || count == 0 => {}
            Style::Json => self.json(serde_json::json!({
                "event": "kept", "scene": scene.to_string_lossy(), "count": count
            })),
            _ => self.line(&format!("kept {count} of {}", scene.display())),
        }
    }

    /// A scene of so many frames is begun.
    pub fn frames(&self, scene: &Path, frames: usize) {
        self.tally().frames(frames);
        if self.style == Style::OpenJd {
            self.line(&format!("openjd_status: {}, {frames} frames", one_line(&scene.display().to_string())));
        }
    }

    /// A scene is done.
    pub fn scene_done(&self, scene: &Path) {
        self.tally().scene_done();
        self.progress(scene);
    }

    /// There is nothing more to do: what came of it all.
    pub fn done(&self, summary: &Summary) {
        if self.style == Style::Json {
            self.json(serde_json::json!({
                "event": "done", "scenes": summary.scenes + summary.left, "failed": summary.failed.len(),
                "left": summary.left, "wrote": self.wrote.load(Ordering::Relaxed),
                "kept": self.kept.load(Ordering::Relaxed), "exit_code": summary.code(),
            }));
        }
    }

    /// Watches the render of a picture of so many pixels.
    pub fn watch<'r>(&'r self, scene: &'r Path, pixels: u64) -> PixelWatch<'r> {
        PixelWatch { reporter: self, pixels, done: AtomicU64::new(0), scene }
    }

    fn tally(&self) -> MutexGuard<'_, Tally> {
        self.tally.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Tells how far all is, if that is farther than was told: by tenths where there is little to do,
    /// else by hundredths.
    fn progress(&self, scene: &Path) {
        let tally = self.tally();
        let done = tally.done();
        if let Some(bar) = &self.bar {
            bar.set_position((done * BAR as f64) as u64);
            bar.set_message(message(&tally, scene));
            return;
        }
        let few = tally.frame().1 * tally.scene().1 == 1 && self.style != Style::OpenJd;
        let steps = if few { 10 } else { 100 };
        // A hair more: thirds add up to a little less than one.
        let now = ((done + 1e-9) * f64::from(steps)) as u64;
        if now <= self.told.fetch_max(now, Ordering::Relaxed) {
            return;
        }
        let percent = now * 100 / u64::from(steps as u32);
        let (frame, frames) = tally.frame();
        match self.style {
            Style::Json => self.json(serde_json::json!({
                "event": "progress", "scene": scene.to_string_lossy(), "percent": percent,
                "frame": frame, "frames": frames, "frames_per_second": tally.rate(),
                "seconds_left": tally.left().map(|left| left.as_secs_f64()),
            })),
            Style::Plain => self.line(&format!("{percent} %  {}", message(&tally, scene))),
            Style::OpenJd => self.line(&format!("openjd_progress: {percent}")),
            Style::Bar | Style::None => {}
        }
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(BAR);
    if let Ok(style) = ProgressStyle::with_template("{wide_bar} {percent:>3} %  {msg}") {
        bar.set_style(style);
    }
    bar
}

/// What is at work, how fast, and how long it takes.
fn message(tally: &Tally, scene: &Path) -> String {
    let name = scene.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let mut parts = vec![one_line(&name)];
    let ((scene, scenes), (frame, frames)) = (tally.scene(), tally.frame());
    if scenes > 1 {
        parts.push(format!("scene {scene}/{scenes}"));
    }
    if frames > 1 {
        parts.push(format!("frame {frame}/{frames}"));
    }
    if let Some(rate) = tally.rate().filter(|_| scenes * frames > 1) {
        parts.push(format!("{rate:.2} frames/s"));
    }
    if let Some(left) = tally.left() {
        parts.push(format!("{} left", clock(left)));
    }
    parts.join(", ")
}

fn clock(time: Duration) -> String {
    let s = time.as_secs();
    match s / 3600 {
        0 => format!("{}:{:02}", s / 60, s % 60),
        hours => format!("{hours}:{:02}:{:02}", s / 60 % 60, s % 60),
    }
}

impl Drop for Reporter {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Watches one picture.
pub(crate) struct PixelWatch<'r> {
    reporter: &'r Reporter,
    pixels: u64,
    done: AtomicU64,
    scene: &'r Path,
}

impl ProgressMonitor for PixelWatch<'_> {
    fn pixels_done(&self, count: u64) {
        if self.reporter.style == Style::None {
            return;
        }
        let done = self.done.fetch_add(count, Ordering::Relaxed) + count;
        {
            let mut tally = self.reporter.tally();
            tally.part(done as f64 / self.pixels.max(1) as f64);
        }
        self.reporter.progress(self.scene);
    }
}

impl PixelWatch<'_> {
    /// The picture is rendered.
    pub fn finish(self) {
        self.reporter.tally().frame_done();
        self.reporter.progress(self.scene);
    }
}
