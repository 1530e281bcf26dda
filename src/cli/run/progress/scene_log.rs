//! Messages about one scene.

use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use anyhow::Result;

use super::message::Message;
use super::reporter::Reporter;
use crate::console::strict_error;
use crate::warning_filter::WarningFilter;
use blinn_core::worded;
use blinn_import::Warning;
use blinn_session::{Notice, SessionError, SessionLog, without_error_codes};

/// Reports each warning of a scene once: the first few of each kind and the number of the others. Collects all if a
/// page needs them. Messages may wait until those of earlier scenes are reported.
pub struct SceneLog<'a> {
    reporter: &'a Reporter,
    /// The scene's number.
    number: usize,
    scene: PathBuf,
    strict: bool,
    warnings: Mutex<Warnings>,
    /// Messages that wait; `None` if each is reported at once.
    waiting: Mutex<Option<Vec<Message>>>,
}

#[derive(Default)]
struct Warnings {
    /// Hashes of all warnings.
    known: HashSet<u64>,
    filter: WarningFilter,
    /// All warnings in order; `None` if nothing needs them.
    collected: Option<Vec<String>>,
}

impl<'a> SceneLog<'a> {
    pub fn new(reporter: &'a Reporter, scene: &Path, strict: bool) -> SceneLog<'a> {
        SceneLog {
            reporter,
            number: 0,
            scene: scene.to_path_buf(),
            strict,
            warnings: Mutex::default(),
            waiting: Mutex::new(None),
        }
    }

    /// Returns a log for the scene of a number that may have others beside it: messages wait for
    /// [`SceneLog::begin_turn`].
    pub fn of_batch(reporter: &'a Reporter, number: usize, scene: &Path, strict: bool) -> SceneLog<'a> {
        SceneLog { number, waiting: Mutex::new(Some(Vec::new())), ..SceneLog::new(reporter, scene, strict) }
    }

    /// Collects all warnings for [`SceneLog::finish`].
    pub fn collecting(self) -> SceneLog<'a> {
        self.warnings().collected = Some(Vec::new());
        self
    }

    /// Reports all messages that wait, and from now on each at once.
    pub fn begin_turn(&self) {
        let mut waiting = self.waiting();
        let messages = waiting.take().unwrap_or_default();
        messages.iter().for_each(|message| self.reporter.report(&self.scene, message));
    }

    /// Drops all messages that wait, as the work on the scene begins anew.
    pub fn clear(&self) {
        if let Some(waiting) = &mut *self.waiting() {
            waiting.clear();
        }
        let mut warnings = self.warnings();
        let collected = warnings.collected.as_ref().map(|_| Vec::new());
        *warnings = Warnings { collected, ..Warnings::default() };
    }

    fn send(&self, message: Message) {
        match &mut *self.waiting() {
            Some(waiting) => waiting.push(message),
            None => self.reporter.report(&self.scene, &message),
        }
    }

    fn waiting(&self) -> MutexGuard<'_, Option<Vec<Message>>> {
        self.waiting.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Reports a written file.
    pub fn wrote(&self, file: &Path) {
        self.wrote_image(file, false);
    }

    /// Reports a written image, and for programs whether it shows nothing.
    pub fn wrote_image(&self, file: &Path, is_empty: bool) {
        self.send(Message::Wrote { file: file.to_path_buf(), is_empty });
    }

    /// Reports the memory in bytes that the scene is expected to need beside the program itself, for --perf.
    pub fn estimate(&self, memory: u64) {
        if self.reporter.prints_stages() {
            self.send(Message::Estimate(memory));
        }
    }

    /// Adds work of this thread that ends now to the file of --trace.
    pub fn trace(&self, name: &str, time: Duration, detail: &str) {
        if let Some(trace) = &self.reporter.trace {
            trace.add(name, time, detail, self.number, &self.scene);
        }
    }

    /// Reports images that --resume kept.
    pub fn kept(&self, count: usize) {
        self.send(Message::Kept(count));
    }

    /// Counts an image that shows nothing.
    pub fn count_empty(&self) {
        self.send(Message::Empty);
    }

    /// Begins to render frames.
    pub fn begin_frames(&self, frames: usize) {
        self.reporter.begin_frames(self.number, frames);
        self.send(Message::Frames(frames));
    }

    /// The current frame is rendered up to a fraction, 0 … 1.
    pub(super) fn frame_progress(&self, fraction: f64) {
        self.reporter.frame_progress(self.number, &self.scene, fraction);
    }

    /// The current frame is rendered.
    pub(super) fn frame_done(&self) {
        self.reporter.frame_done(self.number, &self.scene);
    }

    /// The scene is finished or has failed.
    pub fn scene_done(&self) {
        self.reporter.scene_done(self.number, &self.scene);
    }

    /// Reports a warning unless it was reported before.
    fn report(&self, text: &str) {
        self.report_of_kind(text, text);
    }

    /// Reports the warnings of an import, then how many of each kind were withheld.
    pub fn warn_of_import(&self, warnings: Vec<Warning>) -> Result<()> {
        for warning in warnings {
            if self.strict {
                return Err(strict_error(warning));
            }
            self.report_of_kind(&without_error_codes(&warning.to_string()), &warning.message);
        }
        self.report_withheld();
        Ok(())
    }

    /// Reports a warning; `message` is the part that decides its kind.
    fn report_of_kind(&self, text: &str, message: &str) {
        let mut warnings = self.warnings();
        let mut hasher = DefaultHasher::new();
        text.hash(&mut hasher);
        if !warnings.known.insert(hasher.finish()) {
            return;
        }
        if self.reporter.prints_all_warnings() || warnings.filter.admit(message) {
            self.send(Message::Warning(text.into()));
        }
        if let Some(collected) = &mut warnings.collected {
            collected.push(text.into());
        }
    }

    /// Reports how many warnings were withheld since the last call.
    fn report_withheld(&self) {
        let lines = self.warnings().filter.summary(&worded!("use `verbose` to print all"));
        for line in lines {
            self.send(Message::Warning(line));
        }
    }

    /// Reports the number of withheld warnings and of written files that were not listed, and returns all warnings in their order if they were collected.
    pub fn finish(&self) -> Vec<String> {
        self.report_withheld();
        self.reporter.end_scene();
        self.warnings().collected.take().unwrap_or_default()
    }

    fn warnings(&self) -> MutexGuard<'_, Warnings> {
        self.warnings.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// True if a warning ends the scene.
    pub fn is_strict(&self) -> bool {
        self.strict
    }

    /// Reports the time since the start of a stage, for --perf.
    pub fn stage_since(&self, stage: &str, start: Instant, detail: &str) {
        self.stage(stage, start.elapsed(), detail);
    }
}

impl SessionLog for SceneLog<'_> {
    /// Reports a warning unless it was reported before. With --strict, returns it as an error.
    fn warn(&self, notice: Notice) -> Result<(), SessionError> {
        if self.strict {
            return Err(SessionError::Warning(notice));
        }
        self.report(&without_error_codes(&notice.to_string()));
        Ok(())
    }

    fn hint(&self, notice: Notice) {
        self.send(Message::Hint(notice.to_string()));
    }

    /// Reports a choice, for --verbose.
    fn note(&self, notice: Notice) {
        self.send(Message::Note(notice.to_string()));
    }

    /// Reports the time of a stage, for --perf and --trace.
    fn stage(&self, stage: &str, time: Duration, detail: &str) {
        self.trace(stage, time, detail);
        if self.reporter.prints_stages() {
            self.send(Message::Stage { name: stage.into(), time, detail: detail.into() });
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::LogArgs;

    #[derive(Parser)]
    struct Args {
        #[command(flatten)]
        log: LogArgs,
    }

    #[test]
    fn each_warning_is_collected_once_and_in_order() {
        let reporter = Reporter::new(&Args::parse_from(["blinn"]).log, 1, true);
        let log = SceneLog::new(&reporter, Path::new("a.glb"), false).collecting();
        let texts: Vec<String> = (0..1000).map(|i| format!("no texture {}", i * 7919 % 1000)).collect();
        for text in texts.iter().chain(&texts) {
            assert!(log.warn(Notice::View(text.clone())).is_ok());
        }
        assert_eq!(log.finish(), texts);
        let log = SceneLog::new(&reporter, Path::new("a.glb"), false);
        assert!(log.warn(Notice::View("no texture".into())).is_ok());
        assert!(log.finish().is_empty(), "nothing is kept where no page needs it");
    }
}
