//! Where a session reports what it does.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::error::SessionError;
use crate::notice::Notice;

/// Receives warnings, choices and times of a session. Work runs on several threads.
pub trait SessionLog: Sync {
    /// Receives a warning.
    ///
    /// # Errors
    /// An error, such as [`SessionError::Warning`], ends the work on the scene.
    fn warn(&self, notice: Notice) -> Result<(), SessionError>;

    /// Receives a remark that users may need, and that is no defect.
    fn hint(&self, notice: Notice) {
        let _ = notice;
    }

    /// Receives a choice that the session made.
    fn note(&self, notice: Notice) {
        let _ = notice;
    }

    /// Receives the time that a stage took, with a detail of its work.
    fn stage(&self, stage: &str, time: Duration, detail: &str) {
        let _ = (stage, time, detail);
    }
}

impl dyn SessionLog + '_ {
    /// Reports the time since the start of a stage.
    pub fn stage_since(&self, stage: &str, start: Instant, detail: &str) {
        self.stage(stage, start.elapsed(), detail);
    }
}

/// Collects warnings, each once and in order.
#[derive(Debug, Default)]
pub struct NoticeLog(Mutex<Vec<Notice>>);

impl NoticeLog {
    /// Returns the warnings so far.
    pub fn notices(&self) -> Vec<Notice> {
        self.0.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }
}

impl SessionLog for NoticeLog {
    fn warn(&self, notice: Notice) -> Result<(), SessionError> {
        let mut notices = self.0.lock().unwrap_or_else(|e| e.into_inner());
        if !notices.contains(&notice) {
            notices.push(notice);
        }
        Ok(())
    }
}
