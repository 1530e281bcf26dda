//! `--trace FILE.json`: when each thread worked on which stage of which scene, in the JSON format of Chrome's trace viewer
//! and Perfetto (Google, "Trace Event Format", complete events).

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::thread::ThreadId;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use serde_json::{Value, json};

use crate::files::create_parent_folder;
use blinn_output::{Overwrite, write_atomically};

/// Most events that are kept.
const MAX_EVENTS: usize = 1 << 20;

/// The stages of all scenes of a run.
pub struct Trace {
    file: PathBuf,
    replace: Overwrite,
    since: Instant,
    events: Mutex<Events>,
}

#[derive(Default)]
struct Events {
    spans: Vec<Span>,
    threads: HashMap<ThreadId, usize>,
    /// Events beyond [`MAX_EVENTS`].
    lost: usize,
}

/// Work of a thread.
struct Span {
    name: String,
    detail: String,
    scene: usize,
    path: String,
    thread: usize,
    start: Duration,
    time: Duration,
}

impl Trace {
    /// Starts a trace that is written to `file`.
    pub fn new(file: &Path, replace: Overwrite) -> Trace {
        Trace { file: file.to_path_buf(), replace, since: Instant::now(), events: Mutex::default() }
    }

    /// Adds work of this thread on a scene, which took `time` and ends now.
    pub fn add(&self, name: &str, time: Duration, detail: &str, scene: usize, path: &Path) {
        let end = self.since.elapsed();
        let mut events = self.events.lock().unwrap_or_else(|e| e.into_inner());
        if events.spans.len() >= MAX_EVENTS {
            events.lost += 1;
            return;
        }
        let next = events.threads.len() + 1;
        let thread = *events.threads.entry(std::thread::current().id()).or_insert(next);
        events.spans.push(Span {
            name: name.into(),
            detail: detail.into(),
            scene,
            path: path.to_string_lossy().into_owned(),
            thread,
            start: end.saturating_sub(time),
            time,
        });
    }

    /// Writes the file and returns its path.
    ///
    /// # Errors
    /// The file cannot be written, or exists and must not be overwritten.
    pub fn write(&self) -> Result<&Path> {
        let events = self.events.lock().unwrap_or_else(|e| e.into_inner());
        let micros = |time: Duration| time.as_secs_f64() * 1e6;
        let span = |span: &Span| {
            json!({
                "name": span.name, "ph": "X", "cat": "stage", "pid": 1, "tid": span.thread,
                "ts": micros(span.start), "dur": micros(span.time),
                "args": {"scene": span.path, "index": span.scene, "detail": span.detail},
            })
        };
        let spans: Vec<Value> = events.spans.iter().map(span).collect();
        let trace = json!({
            "traceEvents": spans, "displayTimeUnit": "ms",
            "otherData": {"threads": rayon::current_num_threads(), "lostEvents": events.lost},
        });
        let cannot_be_written = || format!("{} cannot be written", self.file.display());
        create_parent_folder(&self.file)?;
        write_atomically(&self.file, trace.to_string().as_bytes(), self.replace)
            .with_context(cannot_be_written)?;
        Ok(&self.file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_have_the_thread_that_worked() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("a/trace.json");
        let trace = Trace::new(&file, Overwrite::No);
        let work = |scene| trace.add("render", Duration::from_millis(2), "64x64", scene, Path::new("a.glb"));
        std::thread::sleep(Duration::from_millis(3));
        work(1);
        std::thread::scope(|scope| drop(scope.spawn(|| work(2)).join()));
        assert_eq!(trace.write().unwrap(), file);
        let json: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
        let [first, second] = &json["traceEvents"].as_array().unwrap()[..] else { panic!("{json}") };
        assert_eq!(
            (&first["name"], &first["ph"], &first["dur"]),
            (&json!("render"), &json!("X"), &json!(2000.0))
        );
        assert_eq!(json["otherData"], json!({"threads": rayon::current_num_threads(), "lostEvents": 0}));
        assert!(first["ts"].as_f64().unwrap() >= 0.0 && first["tid"] != second["tid"]);
        assert_eq!(second["args"], json!({"scene": "a.glb", "index": 2, "detail": "64x64"}));
        assert!(trace.write().is_err(), "it must not be overwritten");
    }
}
