//! Reports scenes, frames, files and warnings in the format of `--progress`.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::Duration;

use anyhow::{Error, Result};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Value, json};

use super::format::progress_line;
use super::message::Message;
use super::trace::Trace;
use super::work_progress::WorkProgress;
use super::written_files::WrittenFiles;
use crate::args::{LogArgs, PathsArg, ProgressArg};
use crate::console::{eprint_line, print_stdout, single_line};
use crate::message_style::{Level, MessageStyle};
use crate::summary::Summary;
use blinn_session::{format_bytes, without_error_codes};

pub struct Reporter {
    style: Style,
    quiet: bool,
    verbose: bool,
    perf: bool,
    /// True if there are several scenes.
    is_batch: bool,
    bar: Option<ProgressBar>,
    /// True once the bar is on the screen.
    is_bar_drawn: AtomicBool,
    progress: Mutex<WorkProgress>,
    /// Reported steps of progress.
    steps: AtomicU64,
    /// Number of written files.
    wrote: AtomicU64,
    files: WrittenFiles,
    /// The form in which paths of written files are printed on standard output.
    paths: Option<PathsArg>,
    /// The first error of printing paths.
    paths_error: Mutex<Option<Error>>,
    /// True once totals are reported.
    has_totals: AtomicBool,
    /// Number of images that --resume kept.
    kept: AtomicU64,
    /// Number of images that show nothing.
    empty: AtomicU64,
    /// The file of --trace.
    pub trace: Option<Trace>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Style {
    Bar,
    Plain,
    /// One JSON object per line.
    Json,
    /// Messages of the OpenJD specification: `openjd_progress: 50`.
    OpenJd,
    None,
}

/// Length of the progress bar in steps.
const BAR_STEPS: u64 = 10_000;

impl Reporter {
    pub fn new(args: &LogArgs, scenes: usize, quiet: bool) -> Reporter {
        let style = match args.progress {
            _ if quiet => Style::None,
            ProgressArg::Auto if std::io::stderr().is_terminal() => Style::Bar,
            ProgressArg::Plain => Style::Plain,
            ProgressArg::Json => Style::Json,
            ProgressArg::Openjd => Style::OpenJd,
            ProgressArg::Auto | ProgressArg::None => Style::None,
        };
        Reporter {
            style,
            quiet,
            verbose: args.verbose,
            perf: args.perf,
            is_batch: scenes > 1,
            bar: (style == Style::Bar).then(progress_bar),
            is_bar_drawn: AtomicBool::new(false),
            progress: Mutex::new(WorkProgress::new(scenes)),
            steps: AtomicU64::new(0),
            wrote: AtomicU64::new(0),
            files: WrittenFiles::new(),
            paths: None,
            paths_error: Mutex::new(None),
            has_totals: AtomicBool::new(false),
            kept: AtomicU64::new(0),
            empty: AtomicU64::new(0),
            trace: None,
        }
    }

    /// Prints the paths of written files on standard output.
    pub fn with_paths(mut self, paths: Option<PathsArg>) -> Reporter {
        self.paths = paths;
        self
    }

    /// Sets the number of files that will probably be written.
    pub fn expect_files(&self, files: usize) {
        self.files.expect(files as u64);
    }

    /// Reports a message about a scene.
    pub(super) fn report(&self, scene: &Path, message: &Message) {
        match message {
            Message::Warning(text) => self.warn(scene, text),
            Message::Hint(text) => self.hint(scene, text),
            Message::Note(text) => self.note(text),
            Message::Stage { name, time, detail } => self.stage(name, *time, detail),
            Message::Estimate(memory) => {
                self.perf(&format!("estimate {:>10}  memory of the scene", format_bytes(*memory)))
            }
            Message::Wrote { file, is_empty } => self.wrote_image(Some(scene), file, *is_empty),
            Message::Kept(count) => self.kept(scene, *count),
            Message::Empty => self.count_empty(),
            Message::Frames(frames) => self.announce_frames(scene, *frames),
        }
    }

    /// Reports a warning about a scene.
    pub fn warn(&self, scene: &Path, text: &str) {
        if self.quiet {
            return;
        }
        let text = single_line(&without_error_codes(text));
        match self.style {
            Style::Json => {
                self.event(json!({"event": "warning", "scene": scene.to_string_lossy(), "text": text}))
            }
            _ => self.line(&self.label(Level::Warning, &format!("{}: {text}", scene.display()))),
        }
    }

    /// True if all warnings are printed, not only the first few of each kind: for programs and with --verbose.
    pub fn prints_all_warnings(&self) -> bool {
        self.verbose || self.style == Style::Json
    }

    /// Reports a failure, of a scene or of anything else, also with --quiet.
    pub fn fail(&self, scene: Option<&Path>, line: &str) {
        let line = &without_error_codes(line);
        match self.style {
            Style::OpenJd => self.line(&format!("openjd_fail: {line}")),
            Style::Json => self.event(json!({
                "event": "failed", "scene": scene.map(Path::to_string_lossy), "text": line
            })),
            _ => {}
        }
        self.line(&self.label(Level::Error, line));
    }

    /// Reports a remark on a scene; in batches, with --verbose only.
    fn hint(&self, scene: &Path, text: &str) {
        if !self.quiet && (self.verbose || !self.is_batch) {
            let text = format!("{}: {}", scene.display(), single_line(&without_error_codes(text)));
            self.remark(&self.label(Level::Hint, &text));
        }
    }

    /// Reports a remark on all scenes.
    pub fn hint_of_run(&self, text: &str) {
        if !self.quiet {
            self.remark(&self.label(Level::Hint, text));
        }
    }

    /// Reports a choice, for --verbose.
    fn note(&self, text: &str) {
        if self.verbose && !self.quiet {
            self.remark(&single_line(&without_error_codes(text)));
        }
    }

    /// Reports the time of a stage, for --perf.
    fn stage(&self, name: &str, time: Duration, detail: &str) {
        self.perf(&format!("{name:<8} {:>10.1} ms  {detail}", time.as_secs_f64() * 1e3));
    }

    /// True with --perf.
    pub(super) fn prints_stages(&self) -> bool {
        self.perf
    }

    /// Reports any line of --perf.
    pub fn perf(&self, text: &str) {
        if self.perf {
            self.remark(&format!("perf: {text}"));
        }
    }

    /// Reports a written file, of a scene or of all.
    pub fn wrote(&self, scene: Option<&Path>, file: &Path) {
        self.wrote_image(scene, file, false);
    }

    /// Reports a written image, and for programs whether it shows nothing.
    fn wrote_image(&self, scene: Option<&Path>, file: &Path, is_empty: bool) {
        self.wrote.fetch_add(1, Ordering::Relaxed);
        self.print_path(file);
        match self.style {
            _ if self.quiet => {}
            Style::Json => {
                let mut event = json!({
                    "event": "wrote", "scene": scene.map(Path::to_string_lossy), "file": file.to_string_lossy()
                });
                if is_empty {
                    event["empty"] = json!(true);
                }
                self.event(event);
            }
            _ if scene.is_some() && !self.files.add(file) && !self.verbose => {}
            _ => self.text_line(&format!("wrote {}", file.display())),
        }
    }

    /// Prints the path of a written file for --print-paths.
    fn print_path(&self, file: &Path) {
        let end = match self.paths {
            None => return,
            Some(PathsArg::Lines) => b"\n",
            Some(PathsArg::Null) => b"\0",
        };
        let line = [file.as_os_str().as_encoded_bytes(), end].concat();
        if let Err(error) = self.print(&line) {
            self.paths_error().get_or_insert(error);
        }
    }

    /// Writes bytes to standard output, above the progress bar.
    ///
    /// # Errors
    /// Standard output cannot be written.
    pub fn print(&self, bytes: &[u8]) -> Result<()> {
        match &self.bar {
            Some(bar) if self.is_bar_drawn.load(Ordering::Relaxed) => bar.suspend(|| print_stdout(bytes)),
            _ => print_stdout(bytes),
        }
    }

    fn paths_error(&self) -> MutexGuard<'_, Option<Error>> {
        self.paths_error.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Returns the first error of printing paths.
    pub fn paths_printed(&self) -> Result<()> {
        self.paths_error().take().map_or(Ok(()), Err)
    }

    /// Reports the files of a scene that have no lines of their own.
    pub(super) fn end_scene(&self) {
        if let Some(line) = self.files.end_scene().filter(|_| !self.quiet && !self.verbose) {
            self.text_line(&line);
        }
    }

    /// Counts an image that shows nothing.
    fn count_empty(&self) {
        self.empty.fetch_add(1, Ordering::Relaxed);
    }

    /// Reports an archive that --resume kept.
    pub fn kept_archive(&self, file: &Path) {
        match self.style {
            _ if self.quiet => {}
            Style::Json => {
                self.event(json!({"event": "kept", "scene": null, "file": file.to_string_lossy()}))
            }
            _ => self.text_line(&format!("kept {}", file.display())),
        }
    }

    /// Reports images that --resume kept.
    fn kept(&self, scene: &Path, count: usize) {
        self.kept.fetch_add(count as u64, Ordering::Relaxed);
        match self.style {
            _ if self.quiet || count == 0 => {}
            Style::Json => {
                self.event(json!({"event": "kept", "scene": scene.to_string_lossy(), "count": count}))
            }
            _ => self.text_line(&format!("kept {count} of {}", scene.display())),
        }
    }

    /// Announces the frames of a scene.
    fn announce_frames(&self, scene: &Path, frames: usize) {
        if self.style == Style::OpenJd {
            let scene = single_line(&scene.display().to_string());
            self.line(&format!("openjd_status: {scene}, {frames} frames"));
        }
    }

    /// Sets the number of frames of the scene of a number.
    pub(super) fn begin_frames(&self, number: usize, frames: usize) {
        self.progress().begin_frames(number, frames);
    }

    /// The current frame of a scene is rendered up to a fraction, 0 … 1.
    pub(super) fn frame_progress(&self, number: usize, scene: &Path, fraction: f64) {
        if self.style != Style::None {
            self.progress().set_frame_fraction(number, fraction);
            self.report_progress(number, scene);
        }
    }

    /// The current frame of a scene is rendered.
    pub(super) fn frame_done(&self, number: usize, scene: &Path) {
        self.progress().frame_done(number);
        self.report_progress(number, scene);
    }

    /// A scene is finished or has failed.
    pub fn scene_done(&self, number: usize, scene: &Path) {
        self.progress().scene_done(number);
        self.report_progress(number, scene);
    }

    /// Reports that the work waits for changes of files.
    pub fn watching(&self, files: usize) {
        match self.style {
            _ if self.quiet => {}
            Style::Json => self.event(json!({"event": "watching", "files": files})),
            _ => {
                let noun = if files == 1 { "file" } else { "files" };
                self.line(&format!("watching {files} {noun}; Ctrl-C ends"));
            }
        }
    }

    /// Reports the totals at the end.
    pub fn done(&self, summary: &Summary) {
        if self.style != Style::Json {
            if !self.has_totals.load(Ordering::Relaxed) {
                self.files.totals().iter().for_each(|line| self.totals(line));
            }
            return;
        }
        let mut event = json!({
            "event": "done", "scenes": summary.scenes + summary.not_started,
            "failed": summary.failed, "left": summary.left(),
            "wrote": self.wrote.load(Ordering::Relaxed), "kept": self.kept.load(Ordering::Relaxed),
            "exit_code": summary.exit_code(),
        });
        let empty = self.empty.load(Ordering::Relaxed) as usize;
        for (name, count) in
            [("empty", empty), ("skipped", summary.skipped_done), ("skipped_failed", summary.skipped_failed)]
        {
            if count > 0 {
                event[name] = json!(count);
            }
        }
        self.event(event);
    }

    /// Reports what was done with all scenes, for people.
    pub fn totals(&self, text: &str) {
        self.has_totals.store(true, Ordering::Relaxed);
        if !self.quiet {
            self.remark(text);
        }
    }

    fn progress(&self) -> MutexGuard<'_, WorkProgress> {
        self.progress.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Reports the progress if it has reached the next step: 1 %, or 10 % for a single image.
    fn report_progress(&self, number: usize, scene: &Path) {
        let progress = self.progress();
        let fraction = progress.fraction();
        if let Some(bar) = &self.bar {
            // A full bar beside the error of a missing file would look like success.
            if fraction >= 1.0 {
                return;
            }
            self.is_bar_drawn.store(true, Ordering::Relaxed);
            bar.set_position((fraction * BAR_STEPS as f64) as u64);
            bar.set_message(progress_line(&progress, number, scene));
            return;
        }
        let frame = progress.frame(number);
        let is_single = frame.count * progress.scene().count == 1 && self.style != Style::OpenJd;
        let steps: u64 = if is_single { 10 } else { 100 };
        // Thirds add up to slightly less than 1.
        let step = ((fraction + 1e-9) * steps as f64) as u64;
        if step <= self.steps.fetch_max(step, Ordering::Relaxed) {
            return;
        }
        let percent = step * 100 / steps;
        match self.style {
            Style::Json => self.event(json!({
                "event": "progress", "scene": scene.to_string_lossy(), "percent": percent,
                "frame": frame.current, "frames": frame.count,
                "frames_per_second": progress.frames_per_second(),
                "seconds_left": progress.time_left().map(|left| left.as_secs_f64()),
            })),
            Style::Plain => {
                self.text_line(&format!("{percent} %  {}", progress_line(&progress, number, scene)));
            }
            Style::OpenJd => self.line(&format!("openjd_progress: {percent}")),
            Style::Bar | Style::None => {}
        }
    }

    /// A line for people. Beside JSON events it has a prefix, so that programs can tell it apart.
    fn remark(&self, text: &str) {
        match self.style {
            Style::Json => self.line(&format!("blinn: {text}")),
            _ => self.line(text),
        }
    }

    /// A message with its label. Programs that read events get the same on a terminal.
    fn label(&self, level: Level, text: &str) -> String {
        let style = match self.style {
            Style::Json | Style::OpenJd => MessageStyle::Plain,
            _ => MessageStyle::of_stderr(),
        };
        style.label(level, &single_line(text))
    }

    fn event(&self, event: Value) {
        self.line(&event.to_string());
    }

    /// Writes a line to standard error, above the progress bar.
    /// Prints a text with names of files, which may contain line breaks and control characters of terminals.
    fn text_line(&self, text: &str) {
        self.line(&single_line(text));
    }

    fn line(&self, text: &str) {
        match &self.bar {
            Some(bar) if self.is_bar_drawn.load(Ordering::Relaxed) => bar.suspend(|| eprint_line(text)),
            _ => eprint_line(text),
        }
    }
}

fn progress_bar() -> ProgressBar {
    let bar = ProgressBar::new(BAR_STEPS);
    if let Ok(style) = ProgressStyle::with_template("{wide_bar} {percent:>3} %  {msg}") {
        bar.set_style(style);
    }
    bar
}

impl Drop for Reporter {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
