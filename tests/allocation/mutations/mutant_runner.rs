//! Runs mutants within limits of time and memory.

use std::fmt::Arguments;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use blinn::accel::{Accel, AccelSettings};
use blinn::import::{Limits, LoadOptions, load, load_camera_xml, load_environment};
use blinn::integrator::{Frame, Phong};
use blinn::render::{RenderSettings, render};
use blinn::scene::{AnimationChoice, Lighting, PoseSettings, View, pose};

use super::seeds::{Reader, Seed};
use crate::MEMORY;

/// Time limit of a mutant, for the best of three runs.
const TIME: Duration = Duration::from_secs(1);
/// Seconds after which a mutant counts as hanging.
const HANGS: u64 = 60;
/// Memory limit of a mutant in bytes, beyond what was allocated before.
const BYTES: usize = 256 << 20;

/// True if a mutant is running, whose panics are recorded.
static RUNNING: AtomicBool = AtomicBool::new(false);

/// Runs mutants one by one and records failures.
pub struct MutantRunner {
    folder: PathBuf,
    limits: Limits,
    /// The number of mutants run, for the watchdog thread.
    tried: Arc<AtomicU64>,
    longest: Duration,
    largest: usize,
    failures: Vec<String>,
}

impl MutantRunner {
    pub fn new() -> MutantRunner {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mutations");
        std::fs::create_dir_all(&folder).unwrap();
        // Panic messages are recorded from their payload; printed as well, they would bury the list.
        let default_hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !RUNNING.load(Ordering::Relaxed) {
                default_hook(info);
            }
        }));
        let tried = Arc::new(AtomicU64::new(0));
        watch(tried.clone());
        // Small limits, so that allocations outside of them stand out.
        let limits = Limits {
            vertices: 1 << 18,
            triangles: 1 << 18,
            nodes: 1 << 16,
            instances: 1 << 16,
            decompressed_bytes: 16 << 20,
            image_pixels: 1 << 22,
            texture_bytes: 64 << 20,
            ..Limits::default()
        };
        MutantRunner { folder, limits, tried, longest: Duration::ZERO, largest: 0, failures: Vec::new() }
    }

    pub fn tried(&self) -> u64 {
        self.tried.load(Ordering::Relaxed)
    }

    pub fn worst(&self) -> String {
        format!("at most {:?} and {} KiB", self.longest, self.largest >> 10)
    }

    /// Returns true if a seed with these bytes is read without error.
    pub fn reads(&self, seed: &Seed, bytes: &[u8]) -> bool {
        self.write(seed);
        std::fs::write(self.folder.join(seed.changed()), bytes).unwrap();
        self.read(seed).is_ok()
    }

    fn write(&self, seed: &Seed) {
        for (name, bytes) in &seed.files {
            std::fs::write(self.folder.join(name), bytes).unwrap();
        }
    }

    /// Runs one mutant.
    pub fn run(&mut self, seed: &Seed, mutant: &[u8], which: Arguments) {
        self.tried.fetch_add(1, Ordering::Relaxed);
        std::fs::write(self.folder.join(seed.changed()), mutant).unwrap();
        let before = MEMORY.current_usage();
        MEMORY.reset_peak_usage();
        let mut took = Duration::MAX;
        RUNNING.store(true, Ordering::Relaxed);
        for _ in 0..3 {
            let start = Instant::now();
            let outcome = catch_unwind(AssertUnwindSafe(|| self.read(seed).is_ok()));
            took = took.min(start.elapsed());
            if let Err(panic) = outcome {
                let text = panic.downcast_ref::<String>().map(String::as_str);
                let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("?");
                self.failures.push(format!("{}, {which}: panicked: {text}", seed.name));
                break;
            }
            if took <= TIME {
                break;
            }
        }
        RUNNING.store(false, Ordering::Relaxed);
        let bytes = MEMORY.peak_usage().saturating_sub(before);
        if took > TIME || bytes > BYTES {
            self.failures.push(format!("{}, {which}: {took:?}, {} KiB", seed.name, bytes >> 10));
        }
        self.longest = self.longest.max(took);
        self.largest = self.largest.max(bytes);
    }

    /// From the file to pixels. Errors are valid outcomes.
    fn read(&self, seed: &Seed) -> Result<(), ()> {
        let path = self.folder.join(&seed.files[0].0);
        match seed.reader {
            Reader::Scene => self.load_and_render(&path),
            Reader::Sky => load_environment(&path, &self.limits).map(drop).map_err(drop),
            Reader::CameraXml => load_camera_xml(&path).map(drop).map_err(drop),
        }
    }

    fn load_and_render(&self, path: &Path) -> Result<(), ()> {
        let options = LoadOptions { limits: self.limits.clone(), ..LoadOptions::default() };
        let (scene, _) = load(path, &options).map_err(drop)?;
        let at = PoseSettings { time: 0.4, animation: AnimationChoice::All, centre: None };
        let posed = pose(&scene, &at).map_err(drop)?;
        let (accel, _) = Accel::build(&posed, &AccelSettings::default());
        let settings = RenderSettings { width: 4, height: 3, samples: 1, ..Default::default() };
        let (camera, _) = View::default().resolve(&posed, settings.width, settings.height).map_err(drop)?;
        let lit = Lighting::default().resolve(&posed, &camera);
        let frame = Frame::new(&posed, &accel, camera, &lit);
        render(&frame, &Phong::default(), &settings, &()).map(drop).map_err(drop)
    }

    /// Panics with all failures, or returns the number of mutants.
    pub fn finish(self) -> usize {
        let shown = self.failures.iter().take(50).cloned().collect::<Vec<_>>().join("\n");
        assert!(self.failures.is_empty(), "{} of {}:\n{shown}", self.failures.len(), self.tried());
        let _ = std::fs::remove_dir_all(&self.folder);
        self.tried() as usize
    }
}

/// Aborts the process if a mutant hangs; its file stays on disk.
fn watch(tried: Arc<AtomicU64>) {
    std::thread::spawn(move || {
        let mut last = 0;
        loop {
            std::thread::sleep(Duration::from_secs(HANGS));
            let now = tried.load(Ordering::Relaxed);
            if now == last && Arc::strong_count(&tried) > 1 {
                eprintln!("mutant {now} hangs: it lies in target/tmp/mutations");
                std::process::abort();
            }
            last = now;
        }
    });
}
