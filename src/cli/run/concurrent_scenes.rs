//! Renders small scenes at the same time, each on a thread of its own.
//!
//! Threads that share a small picture wait for each other, and reading a file or encoding an image keeps one of them busy.
//! A thread that renders a scene from its file to its images never waits.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, Scope};

use anyhow::{Error, Result};
use rayon::ThreadPoolBuilder;

use super::batch::{Batch, RunEnd, is_disk_full};
use super::memory_estimate::MemoryError;
use super::panics;
use super::scene_task::{RenderedScene, SceneTask};
use crate::cli::plan::{NumberedScene, RenderPlan, load_limits};
use crate::cli::scene_file::is_stdin;
use crate::cli::usage::UsageError;
use crate::import::{LoadError, file_version};
use crate::output::ProcessorPermits;

/// Memory in bytes that each scene may need at least.
const MIN_SHARE: u64 = 1 << 30;
/// Largest file of a small scene, in bytes.
const MAX_FILE: u64 = 16 << 20;
/// Most samples of all images of a small scene: a turntable of 36 frames in the default size.
const MAX_SAMPLES: u64 = 1 << 27;
/// Size of an image whose size depends on the scene.
const USUAL_SIZE: (u32, u32) = (1280, 720);
/// Scenes that wait for a thread, for each thread.
const WAITING: usize = 1;
/// Scenes that may be finished before an earlier one, for each thread.
const AHEAD: usize = 16;
/// Most scenes that may be finished before an earlier one. Each may have a temporary file.
const MAX_AHEAD: usize = 256;
/// Stack of a thread in bytes, as that of the main thread.
const STACK: usize = 8 << 20;

/// Renders small scenes of a plan at the same time.
pub struct ConcurrentScenes {
    /// The plan of a scene that is rendered beside others: it may need its share of the memory.
    shared_plan: RenderPlan,
    /// Number of scenes at the same time: a quarter more than threads at work, since some wait for the disk.
    scenes: usize,
    /// Number of threads at work.
    threads: usize,
}

impl ConcurrentScenes {
    /// Returns `None` for a plan whose scenes are rendered one after the other: their images are large or go to a stream,
    /// or there are few scenes or little memory.
    pub fn for_plan(plan: &RenderPlan) -> Option<ConcurrentScenes> {
        let threads = rayon::current_num_threads();
        let count = plan.scene_range().len();
        let is_serial = plan.dry_run || plan.check.is_some() || plan.outputs.is_stdout();
        if is_serial || count < threads.max(2) || !has_small_images(plan) {
            return None;
        }
        let memory = load_limits(plan.max_memory).memory_bytes;
        let by_memory = usize::try_from(memory / MIN_SHARE).unwrap_or(usize::MAX);
        let scenes = (threads + threads.div_ceil(4)).min(by_memory);
        let shared_plan = || RenderPlan { max_memory: Some(memory / scenes as u64), ..plan.clone() };
        (scenes > 1 && threads > 1).then(|| ConcurrentScenes { shared_plan: shared_plan(), scenes, threads })
    }

    /// Renders scenes and reports them in their order. Each has its share of the memory; one that needs more is rendered
    /// again alone, with all threads.
    ///
    /// # Errors
    /// The list of scenes cannot be read.
    pub fn render<'a>(
        &'a self,
        batch: &mut Batch<'a>,
        scenes: impl Iterator<Item = Result<NumberedScene, UsageError>>,
    ) -> Result<RunEnd, UsageError> {
        let (task_sender, tasks) = mpsc::channel();
        let (result_sender, results) = mpsc::channel();
        let tasks = Mutex::new(tasks);
        let is_stopped = AtomicBool::new(false);
        thread::scope(|scope| {
            let permits = ProcessorPermits::new(self.threads);
            let worker = || Worker { tasks: &tasks, is_stopped: &is_stopped, permits: permits.clone() };
            let started =
                (0..self.scenes).take_while(|_| worker().spawn(scope, result_sender.clone())).count();
            drop(result_sender);
            let mut queue = SceneQueue {
                batch,
                tasks: task_sender,
                results,
                is_stopped: &is_stopped,
                threads: started,
                sent: 0,
                running: 0,
                reported: 0,
                rendered: BTreeMap::new(),
            };
            queue.render(&self.shared_plan, scenes)
        })
    }
}

/// Returns true if the images of each scene have few samples.
pub fn has_small_images(plan: &RenderPlan) -> bool {
    let options = &plan.options;
    let side = |side| (side, side);
    let (width, height) = options.size.or(options.max_size.map(side)).unwrap_or(USUAL_SIZE);
    let samples = u64::from(width) * u64::from(height) * u64::from(options.settings.samples);
    let frames = plan.frames.known().map_or(u64::MAX, |frames| frames.len() as u64);
    samples.saturating_mul(frames) <= MAX_SAMPLES
}

/// Returns true if a scene has a small file.
fn is_small(path: &Path) -> bool {
    !is_stdin(path) && file_version(path).is_none_or(|(bytes, ..)| bytes <= MAX_FILE)
}

/// A task and its place in the order.
type NumberedTask<'a> = (usize, SceneTask<'a>);
/// A scene and its place in the order; `None` if it was not started.
type NumberedResult = (usize, Option<RenderedScene>);

/// Renders scenes on a thread.
struct Worker<'s, 'a> {
    tasks: &'s Mutex<Receiver<NumberedTask<'a>>>,
    /// True if no more scenes should be started.
    is_stopped: &'s AtomicBool,
    permits: Arc<ProcessorPermits>,
}

impl<'s, 'a: 's> Worker<'s, 'a> {
    /// Starts the thread. Returns false if the system refuses it.
    fn spawn<'e>(self, scope: &'s Scope<'s, 'e>, results: Sender<NumberedResult>) -> bool
    where
        'e: 's,
    {
        let thread = thread::Builder::new().name("scene".into()).stack_size(STACK);
        thread.spawn_scoped(scope, move || self.run(&results)).is_ok()
    }

    fn run(&self, results: &Sender<NumberedResult>) {
        // Parallel iterators run on this thread alone.
        let _pool = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
        loop {
            let next = self.tasks.lock().unwrap_or_else(PoisonError::into_inner).recv();
            let Ok((place, task)) = next else { return };
            let is_stopped = self.is_stopped.load(Ordering::Relaxed);
            let render = || panics::catch(|| Ok(self.permits.run(|| task.render_apart()))).ok();
            let rendered = if is_stopped { None } else { render() };
            if rendered.as_ref().is_some_and(|scene| scene.outcome.as_ref().is_err_and(is_disk_full)) {
                self.is_stopped.store(true, Ordering::Relaxed);
            }
            if results.send((place, rendered)).is_err() {
                return;
            }
        }
    }
}

/// Gives scenes to threads, and reports them in their order.
struct SceneQueue<'q, 'a> {
    batch: &'q mut Batch<'a>,
    tasks: Sender<NumberedTask<'a>>,
    results: Receiver<NumberedResult>,
    is_stopped: &'q AtomicBool,
    threads: usize,
    /// Number of scenes that were given to threads.
    sent: usize,
    /// Number of scenes that threads have.
    running: usize,
    /// Number of scenes that were reported.
    reported: usize,
    /// Scenes that wait for earlier ones, by their places.
    rendered: BTreeMap<usize, Option<RenderedScene>>,
}

impl<'a> SceneQueue<'_, 'a> {
    fn render(
        &mut self,
        shared_plan: &'a RenderPlan,
        scenes: impl Iterator<Item = Result<NumberedScene, UsageError>>,
    ) -> Result<RunEnd, UsageError> {
        let end = self.batch.plan.scene_range().end;
        let mut error = None;
        for scene in scenes {
            let NumberedScene { number, path } = match scene {
                Ok(scene) => scene,
                Err(list_error) => {
                    error = Some(list_error);
                    break;
                }
            };
            let is_shared = self.threads > 0 && is_small(&path);
            let capacity = if is_shared { self.threads * (1 + WAITING) } else { 1 };
            let max_ahead = (self.threads.max(1) * AHEAD).min(MAX_AHEAD);
            while self.running >= capacity || self.sent - self.reported >= max_ahead {
                self.receive();
            }
            if self.is_stopped.load(Ordering::Relaxed) {
                self.batch.summary.not_started += end + 1 - number;
                break;
            }
            if !is_shared {
                self.render_alone(number, &path);
            } else if let Some(task) = self.batch.task(number, &path) {
                let task = SceneTask { plan: shared_plan, ..task };
                // Threads receive as long as there is a sender.
                self.running += usize::from(self.tasks.send((self.sent, task)).is_ok());
                self.sent += 1;
            }
        }
        while self.running > 0 {
            self.receive();
        }
        let is_stopped = self.is_stopped.load(Ordering::Relaxed);
        let end = if is_stopped { RunEnd::DiskFull } else { RunEnd::Complete };
        error.map_or(Ok(end), Err)
    }

    /// Waits for a scene, and reports all that follow on those reported before.
    fn receive(&mut self) {
        self.collect();
        while let Some(scene) = self.rendered.remove(&self.reported) {
            self.reported += 1;
            match scene {
                None => self.batch.summary.not_started += 1,
                Some(scene) if scene.outcome.as_ref().is_err_and(needs_more_memory) => {
                    while self.running > 0 {
                        self.collect();
                    }
                    self.render_alone(scene.index, &scene.path);
                }
                Some(scene) => {
                    let outcome = self.batch.add(scene);
                    self.stop_if_full(outcome.as_ref().err());
                }
            }
        }
    }

    fn collect(&mut self) {
        match self.results.recv() {
            Ok((place, scene)) => {
                self.running -= 1;
                self.rendered.insert(place, scene);
            }
            // All threads have ended.
            Err(_) => (self.running, self.reported) = (0, self.sent),
        }
    }

    /// Renders a scene with all threads, while no other is rendered.
    fn render_alone(&mut self, number: usize, path: &Path) {
        let outcome = self.batch.render_scene(number, path);
        self.stop_if_full(outcome.as_ref().err());
    }

    /// Starts no more scenes if nothing more can be written.
    fn stop_if_full(&self, error: Option<&Error>) {
        if error.is_some_and(is_disk_full) {
            self.is_stopped.store(true, Ordering::Relaxed);
        }
    }
}

/// Returns true for the error of a scene that exceeds its limits.
fn needs_more_memory(error: &Error) -> bool {
    let is_limit = |cause: &(dyn std::error::Error + 'static)| {
        matches!(cause.downcast_ref(), Some(LoadError::Limit { .. })) || cause.is::<MemoryError>()
    };
    error.chain().any(is_limit)
}
