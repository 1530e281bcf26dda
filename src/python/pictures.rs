//! Pictures of a job that runs, for Python.

use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use anyhow::Result;
use pyo3::prelude::*;

use super::errors::{CallDepth, render_error, warn};
use super::picture::PyPicture;
use super::pool::{self, POLL_INTERVAL};
use super::render_job::{JobMonitor, Message, RenderJob};
use blinn_cli::embed::catch_panic;

/// Pictures that may wait for Python.
const QUEUED_PICTURES: usize = 4;

/// Pictures in the order of their cameras. Iterating waits for the next one.
#[pyclass(name = "Pictures", module = "blinn")]
pub struct PyPictures {
    monitor: Arc<JobMonitor>,
    receiver: Mutex<Option<Receiver<Message>>>,
    thread: Mutex<Option<JoinHandle<Result<()>>>>,
    progress: Option<Py<PyAny>>,
    name: String,
    left: usize,
}

impl PyPictures {
    /// Starts a job.
    pub fn start(mut job: RenderJob, progress: Option<Py<PyAny>>) -> PyResult<PyPictures> {
        let pool = pool::current().map_err(|e| render_error(&e))?;
        let monitor = Arc::new(JobMonitor::default());
        let (sender, receiver) = sync_channel(QUEUED_PICTURES);
        let (left, name) = (job.cameras.len(), job.name.display().to_string());
        let job_monitor = monitor.clone();
        let thread = std::thread::Builder::new().name("blinn-job".into());
        let thread = thread.spawn(move || catch_panic(|| job.run(&pool, &job_monitor, &sender)))?;
        Ok(PyPictures {
            monitor,
            receiver: Mutex::new(Some(receiver)),
            thread: Mutex::new(Some(thread)),
            progress,
            name,
            left,
        })
    }

    /// Waits for the only picture.
    pub fn single(mut self, py: Python<'_>) -> PyResult<PyPicture> {
        let picture = self.next(py, CallDepth::Wrapped)?;
        // The warnings come last.
        self.next(py, CallDepth::Wrapped)?;
        picture.ok_or_else(|| render_error(&anyhow::anyhow!("no picture was rendered")))
    }

    /// Waits for the next picture; `None` after the last one.
    fn next(&mut self, py: Python<'_>, depth: CallDepth) -> PyResult<Option<PyPicture>> {
        loop {
            let received = py.detach(|| {
                let receiver = self.receiver.lock().unwrap_or_else(|e| e.into_inner());
                receiver.as_ref().map(|receiver| receiver.recv_timeout(POLL_INTERVAL))
            });
            if let Err(error) = py.check_signals().and_then(|()| self.report_progress(py)) {
                self.cancel();
                return Err(error);
            }
            match received {
                Some(Ok(Message::Picture(picture))) => {
                    self.left = self.left.saturating_sub(1);
                    return Ok(Some(PyPicture::new(*picture)));
                }
                Some(Ok(Message::Warnings(warnings))) => warn(py, &self.name, &warnings, depth)?,
                Some(Err(RecvTimeoutError::Timeout)) => {}
                Some(Err(RecvTimeoutError::Disconnected)) | None => return self.finish(py).map(|()| None),
            }
        }
    }

    fn report_progress(&self, py: Python<'_>) -> PyResult<()> {
        match &self.progress {
            Some(progress) => progress.call1(py, (self.monitor.fraction(),)).map(|_| ()),
            None => Ok(()),
        }
    }

    /// Waits for the end of the job and returns its error.
    fn finish(&self, py: Python<'_>) -> PyResult<()> {
        let thread = self.thread.lock().unwrap_or_else(|e| e.into_inner()).take();
        let Some(thread) = thread else { return Ok(()) };
        match py.detach(|| thread.join()) {
            Ok(outcome) => outcome.map_err(|e| render_error(&e)),
            Err(_) => Err(render_error(&anyhow::anyhow!("the renderer failed unexpectedly"))),
        }
    }

    fn cancel(&self) {
        self.monitor.cancel();
        // The job may wait until a picture is received.
        self.receiver.lock().unwrap_or_else(|e| e.into_inner()).take();
    }
}

#[pymethods]
impl PyPictures {
    fn __iter__(this: PyRef<'_, Self>) -> PyRef<'_, Self> {
        this
    }

    fn __next__(&mut self, py: Python<'_>) -> PyResult<Option<PyPicture>> {
        self.next(py, CallDepth::Direct)
    }

    /// Number of pictures that have not been returned yet.
    fn __len__(&self) -> usize {
        self.left
    }

    /// Stop the job. Pictures that are not finished are lost.
    fn close(&mut self, py: Python<'_>) {
        self.cancel();
        let thread = self.thread.lock().unwrap_or_else(|e| e.into_inner()).take();
        py.detach(|| thread.map(JoinHandle::join));
        self.left = 0;
    }
}

impl Drop for PyPictures {
    fn drop(&mut self) {
        self.cancel();
    }
}
