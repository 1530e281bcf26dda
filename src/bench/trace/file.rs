//! Reads the files of `--trace`: complete events in the JSON format of Chrome's trace viewer.

use std::path::Path;

use serde::Deserialize;

use crate::limited_file::read_limited;

/// Larger files are not read: `--trace` keeps a million events.
const MAX_BYTES: u64 = 1 << 30;

/// Microseconds that no run takes: 30 years.
const MAX_MICROS: f64 = 1e15;

/// How to create a trace, for messages.
const HINT: &str = "create a file with: blinn render SCENES --threads 1 --trace FILE";

/// When each thread of a run worked on which stage of which scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Trace {
    /// The threads that the run could use.
    pub(super) threads: u32,
    pub(super) spans: Vec<Span>,
}

/// A stage of a scene on a thread. It may hold others: what the thread did while it waited.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Span {
    pub stage: String,
    /// The number of the scene, and its path.
    pub scene: u64,
    pub path: String,
    pub thread: u64,
    /// Seconds since the start of the run.
    pub start: f64,
    pub seconds: f64,
}

impl Span {
    /// Seconds from the start of the run to the end of the span.
    pub fn end(&self) -> f64 {
        self.start + self.seconds
    }
}

#[derive(Deserialize)]
struct TraceFile {
    #[serde(rename = "traceEvents")]
    events: Vec<Event>,
    #[serde(rename = "otherData")]
    other: OtherData,
}

#[derive(Deserialize)]
struct OtherData {
    threads: u32,
    #[serde(rename = "lostEvents")]
    lost_events: u64,
}

#[derive(Deserialize)]
struct Event {
    name: String,
    tid: u64,
    ts: f64,
    dur: f64,
    args: EventArgs,
}

#[derive(Deserialize)]
struct EventArgs {
    scene: String,
    index: u64,
}

impl Trace {
    /// Reads a file of `--trace`.
    ///
    /// # Errors
    /// The file cannot be read, is not a trace of blinn, or lacks events.
    pub fn read(path: &Path) -> Result<Trace, TraceError> {
        let error = |message: String| TraceError { file: path.display().to_string(), message };
        let text = read_limited(path, MAX_BYTES, "a trace of blinn").map_err(error)?;
        Trace::parse(&text).map_err(error)
    }

    fn parse(text: &[u8]) -> Result<Trace, String> {
        let file: TraceFile = serde_json::from_slice(text).map_err(|e| match e.classify() {
            serde_json::error::Category::Data => format!("not a trace of this version of blinn ({HINT})"),
            _ => format!("{e}: the file is damaged or not JSON ({HINT})"),
        })?;
        let OtherData { threads, lost_events } = file.other;
        if lost_events > 0 {
            return Err(format!("{lost_events} events did not fit the trace; trace fewer scenes"));
        }
        if threads == 0 || file.events.is_empty() {
            return Err(format!("the trace has no events ({HINT})"));
        }
        let is_time = |micros: f64| (0.0..MAX_MICROS).contains(&micros);
        let span = |(i, event): (usize, Event)| {
            if !is_time(event.ts) || !is_time(event.dur) {
                return Err(format!("event {i}: its time is negative, or longer than any run"));
            }
            Ok(Span {
                stage: event.name,
                scene: event.args.index,
                path: event.args.scene,
                thread: event.tid,
                start: event.ts / 1e6,
                seconds: event.dur / 1e6,
            })
        };
        let spans = file.events.into_iter().enumerate().map(span).collect::<Result<_, String>>()?;
        Ok(Trace { threads, spans })
    }
}

/// A trace that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {message}")]
pub struct TraceError {
    file: String,
    message: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(events: &str, other: &str) -> Vec<u8> {
        format!(r#"{{"traceEvents": [{events}], "otherData": {other}}}"#).into_bytes()
    }

    #[test]
    fn traces_of_other_programs_and_damaged_ones_are_errors() {
        let event = |ts: &str| {
            format!(
                r#"{{"name": "load", "ph": "X", "tid": 1, "ts": {ts}, "dur": 5e5, "args": {{"scene": "a", "index": 2}}}}"#
            )
        };
        let whole = r#"{"threads": 3, "lostEvents": 0}"#;
        let trace = Trace::parse(&file(&event("2e6"), whole)).unwrap();
        assert_eq!((trace.threads, trace.spans.len()), (3, 1));
        let span = &trace.spans[0];
        assert_eq!((span.stage.as_str(), span.scene, span.start, span.end()), ("load", 2, 2.0, 2.5));
        for (text, message) in [
            (file(&event("-1"), whole), "event 0"),
            (file(&event("1e300"), whole), "event 0"),
            (file("", whole), "no events"),
            (file(&event("1"), r#"{"threads": 1, "lostEvents": 7}"#), "7 events did not fit"),
            (file(&event("1"), r#"{"lostEvents": 0}"#), "not a trace of this version"),
            (b"[]".to_vec(), "not a trace of this version"),
            (b"{".to_vec(), "damaged"),
        ] {
            let error = Trace::parse(&text).unwrap_err();
            assert!(error.contains(message), "{error}");
        }
    }
}
