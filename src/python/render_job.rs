//! Renders pictures on a thread of its own, while Python's thread waits for them and for Ctrl-C.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex};

use anyhow::{Result, anyhow};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::camera::PyCamera;
use super::log::WarningLog;
use super::posed::PosedCell;
use blinn_accel::Accel;
use blinn_core::cancellation::CancelToken;
use blinn_output::Picture;
use blinn_render::ProgressMonitor;
use blinn_scene::{Scene, View};
use blinn_session::{
    EmptyImages, PlannedFrame, PosedFrame, RenderedImage, SceneRenderer, SessionError, SessionLog,
    SessionPlan,
};

/// Pixels of pictures that are rendered at the same time. Larger pictures keep all threads busy alone.
const CONCURRENT_PIXELS: u64 = 1 << 20;

/// An acceleration structure that a job leaves for the next one of the same scene.
pub struct SpareAccel {
    pub accel: Accel,
    /// The time in seconds that it shows.
    time: f64,
}

/// The start of a scene's clip, and an acceleration structure.
pub struct ClipStart {
    pub cell: PosedCell,
    pub spare: Mutex<Option<SpareAccel>>,
}

impl ClipStart {
    pub fn new(cell: PosedCell) -> ClipStart {
        ClipStart { cell, spare: Mutex::default() }
    }

    /// A copy of the start, with the spare acceleration structure if there is one.
    fn frame(&self) -> PosedFrame<'_> {
        let PosedFrame { time, posed, .. } = self.cell.borrow_dependent();
        let spare = self.spare.lock().unwrap_or_else(|e| e.into_inner()).take();
        let accel = spare.map(|mut spare| {
            if spare.time != *time {
                spare.accel.update(posed);
            }
            spare.accel
        });
        PosedFrame { time: *time, posed: posed.clone(), accel }
    }

    fn keep(&self, frame: PosedFrame) {
        let spare = frame.accel.map(|accel| SpareAccel { accel, time: frame.time });
        *self.spare.lock().unwrap_or_else(|e| e.into_inner()) = spare;
    }
}

/// Pictures to render of a scene.
pub struct RenderJob {
    pub start: Arc<ClipStart>,
    /// The scene's path or name.
    pub name: PathBuf,
    pub plan: SessionPlan,
    /// A picture for each; `None` stands for the view of the plan.
    pub cameras: Vec<Option<PyCamera>>,
    /// In seconds.
    pub time: f64,
}

/// Results of a job.
pub enum Message {
    Picture(Box<Picture>),
    /// Warnings, after all pictures.
    Warnings(Vec<String>),
}

/// Progress of all pictures, and the request to stop.
#[derive(Default)]
pub struct JobMonitor {
    is_cancelled: AtomicBool,
    pixels_done: AtomicU64,
    pixels: AtomicU64,
}

impl JobMonitor {
    /// Ends the job early.
    pub fn cancel(&self) {
        self.is_cancelled.store(true, Ordering::Relaxed);
    }

    /// The finished part, 0 to 1.
    pub fn fraction(&self) -> f64 {
        let pixels = self.pixels.load(Ordering::Relaxed).max(1);
        (self.pixels_done.load(Ordering::Relaxed) as f64 / pixels as f64).min(1.0)
    }
}

impl ProgressMonitor for JobMonitor {
    fn pixels_done(&self, count: u64) {
        self.pixels_done.fetch_add(count, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }
}

impl RenderJob {
    /// Renders all pictures in order. All work is done in `pool`, which never waits for Python.
    ///
    /// # Errors
    /// The camera or another option does not suit the scene, or nobody receives the pictures.
    pub fn run(
        &mut self,
        pool: &ThreadPool,
        monitor: &JobMonitor,
        sender: &SyncSender<Message>,
    ) -> Result<()> {
        let scene = self.start.cell.borrow_owner();
        if let Some(Some(camera)) = self.cameras.first() {
            let complete = Some(camera.resolve(self.plan.options.size_for(scene)));
            self.plan.options.view = View { complete, ..View::default() };
        }
        let log = WarningLog::default();
        let outcome = self.render(scene, &log, pool, monitor, sender);
        let _ = sender.send(Message::Warnings(log.into_warnings()));
        outcome
    }

    fn render(
        &self,
        scene: &Scene,
        log: &WarningLog,
        pool: &ThreadPool,
        monitor: &JobMonitor,
        sender: &SyncSender<Message>,
    ) -> Result<()> {
        let (renderer, frame) = pool.install(|| -> Result<_> {
            let mut start = self.start.frame();
            let renderer =
                SceneRenderer::from_start(&self.plan, scene, log, &mut start, &CancelToken::default())?;
            let frame = renderer.setup.frame_at(self.time, start)?;
            Ok((renderer, frame))
        })?;
        monitor.pixels.store(renderer.pixels() * self.cameras.len() as u64, Ordering::Relaxed);
        let planned = PlannedFrame::at(1, self.time);
        let render = |camera: &Option<PyCamera>| {
            let camera = match camera {
                Some(camera) => camera.resolve(renderer.full_size()),
                None => renderer.camera(&planned, &frame.posed)?,
            };
            renderer.render_view(camera, &planned, &frame, monitor)
        };
        let empty_images = EmptyImages::default();
        let mut number = 0;
        let concurrent =
            (CONCURRENT_PIXELS / renderer.pixels().max(1)).clamp(1, pool.current_num_threads() as u64);
        for cameras in self.cameras.chunks(concurrent as usize) {
            let images: Vec<Result<RenderedImage, SessionError>> =
                pool.install(|| cameras.par_iter().map(render).collect());
            for image in images {
                let RenderedImage { picture, empty, .. } = image?;
                number += 1;
                if let Some(reason) = empty {
                    empty_images.add(reason, number);
                }
                // Without a receiver, the job ends.
                sender.send(Message::Picture(Box::new(picture))).map_err(|_| anyhow!("cancelled"))?;
            }
        }
        if let Some(notice) = empty_images.summary(self.cameras.len()) {
            log.warn(notice)?;
        }
        self.start.keep(frame);
        Ok(())
    }
}
