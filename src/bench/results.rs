//! The results of a benchmark run, as its JSON file stores them.

use serde::{Deserialize, Serialize};

use super::calibration::Calibration;
use super::interleaved_timer::Timing;
use super::manifest::sha256_of_file;
use super::stage::BenchStage;
use super::stage_record::StageRecord;
use super::stats::{log_std_dev, median};

/// The format's name and version.
pub(super) const FORMAT: &str = "blinn bench 2";

/// The results of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BenchResults {
    /// `blinn bench 2`.
    pub format: String,
    /// The version of blinn.
    pub version: String,
    /// The program that measured; empty in files of earlier versions.
    #[serde(default)]
    pub program: Program,
    /// When the run ended, in seconds since 1970.
    #[serde(default)]
    pub unix_time: u64,
    /// The machine.
    pub machine: Machine,
    /// The settings.
    pub settings: RecordedSettings,
    /// The scenes.
    pub scenes: Vec<SceneResults>,
}

/// The executable file that measured. The version alone does not tell builds apart.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Program {
    /// SHA-256 of the file in hexadecimal digits; `None` where it cannot be read.
    pub sha256: Option<String>,
    /// The processor architecture and the system that it was compiled for, such as `x86_64-linux`.
    pub target: String,
    /// The compiler, such as `rustc 1.92.0 (ded5c06cf 2025-12-08)`; empty where it is unknown.
    pub rustc: String,
    /// The commit of its source in hexadecimal digits; `None` where the build does not know it.
    pub commit: Option<String>,
}

impl Program {
    /// The file of this process.
    pub(super) fn current() -> Program {
        let file = std::env::current_exe().ok();
        Program {
            sha256: file.and_then(|file| sha256_of_file(&file).ok()),
            target: format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS),
            rustc: env!("BLINN_RUSTC").into(),
            commit: Some(env!("BLINN_BUILD_COMMIT").to_string()).filter(|commit| !commit.is_empty()),
        }
    }
}

/// A machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Machine {
    /// The processor's name.
    pub cpu: String,
    /// Its family and model, such as `family 25, model 1`; empty where they are unknown. Some names are those of many models.
    pub cpu_model: String,
    /// Logical processors.
    pub cores: u32,
    /// Physical memory in bytes.
    pub memory_bytes: u64,
    /// Name and version of the operating system.
    pub os: String,
    /// Version of the kernel.
    pub kernel: String,
    /// The widest SIMD level that blinn supports here.
    pub simd: String,
}

/// The settings that influence results.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RecordedSettings {
    /// The command line.
    pub command: Vec<String>,
    /// Widths and heights of the images in pixels.
    pub sizes: Vec<[u32; 2]>,
    /// Samples per pixel of frames.
    pub samples: u32,
    /// Rounds over all scenes.
    pub rounds: u32,
    /// The measured numbers of threads.
    pub threads: Vec<u32>,
    /// The SIMD level.
    pub simd: String,
    /// [`Calibration::VERSION`]. Relative times compare only within a version.
    pub calibration: u32,
    /// The build is not optimised.
    pub debug_build: bool,
}

/// The results of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneResults {
    /// `scan 70k`, or the name of a file.
    pub name: String,
    /// SHA-256 of its file in hexadecimal digits.
    #[serde(default)]
    pub sha256: Option<String>,
    /// Triangles, counted for each instance.
    #[serde(default)]
    pub triangles: u64,
    /// Its BVHs.
    #[serde(default)]
    pub tree: Option<BvhResults>,
    /// Its stages, for each number of threads.
    #[serde(default)]
    pub stages: Vec<StageResults>,
}

/// Statistics of the BVHs of a scene, which do not depend on the machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct BvhResults {
    /// Inner nodes.
    pub nodes: u64,
    /// Triangles in the BVHs. Shared and coincident ones count once.
    pub entries: u64,
    /// Memory in bytes.
    pub bytes: u64,
    /// Bytes per triangle in the BVHs.
    pub bytes_per_triangle: Option<f64>,
    /// [`blinn_accel::Accel::sah_cost`].
    pub sah_cost: Option<f64>,
}

/// The results of a stage. Missing and non-finite numbers are null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageResults {
    /// The stage.
    pub stage: BenchStage,
    /// The number of threads.
    pub threads: u32,
    /// The camera of the manifest, for stages that depend on it; null for the default view.
    #[serde(default)]
    pub camera: Option<String>,
    /// The width of the image in pixels, for stages that depend on its size.
    #[serde(default)]
    pub width: Option<u32>,
    /// The height of the image in pixels, for stages that depend on its size.
    #[serde(default)]
    pub height: Option<u32>,
    /// The number of rays, for stages that only trace.
    #[serde(default)]
    pub rays: Option<u64>,
    /// The [`super::WorkHash`] of the hits, or of the pixels of the frame.
    #[serde(default)]
    pub hash: Option<String>,
    /// Inner nodes that a ray visits, if it is traced alone.
    #[serde(default)]
    pub nodes_per_ray: Option<f64>,
    /// Blocks of up to four triangles that a ray visits, if it is traced alone.
    #[serde(default)]
    pub blocks_per_ray: Option<f64>,
    /// Triangles that a ray visits, if it is traced alone.
    #[serde(default)]
    pub triangles_per_ray: Option<f64>,
    /// Seconds of each round: the median of its samples, without waiting for a processor.
    #[serde(default)]
    pub seconds: Vec<Option<f64>>,
    /// The same in units of the interleaved calibration loop.
    #[serde(default)]
    pub relative: Vec<Option<f64>>,
    /// Seconds of each round by the clock: `seconds` with the time spent waiting for a processor.
    #[serde(default)]
    pub wall_seconds: Vec<Option<f64>>,
    /// Peak memory of a process that measured nothing else, for each round.
    #[serde(default)]
    pub peak_bytes: Vec<Option<u64>>,
    /// Joules of each round: the energy of the processor packages for one repetition. Null where it cannot be read.
    #[serde(default)]
    pub joules: Vec<Option<f64>>,
    /// Seconds of the fastest sample of all rounds.
    #[serde(default)]
    pub least_seconds: Option<f64>,
    /// The same in units of the fastest run of the calibration loop. On one thread two runs agree better on it than on
    /// medians; on several threads it is chance.
    #[serde(default)]
    pub least_relative: Option<f64>,
    /// Fraction of the time that other programs had the processors: the median of the rounds.
    #[serde(default)]
    pub waited: Option<f64>,
    /// Median of `seconds`. This and the following fields are for readers; blinn recomputes them.
    #[serde(default)]
    pub median_seconds: Option<f64>,
    /// Median of `relative`.
    #[serde(default)]
    pub median_relative: Option<f64>,
    /// Standard deviation of the logarithms of `relative`.
    #[serde(default)]
    pub spread: Option<f64>,
    /// Millions of rays per second, from the median.
    #[serde(default)]
    pub mrays_per_second: Option<f64>,
}

impl StageResults {
    /// Summarizes the rounds.
    pub(super) fn new(record: &StageRecord, camera: Option<&str>) -> StageResults {
        let StageRecord { key, work, rounds } = record;
        let finite = |value: fn(&Timing) -> f64| -> Vec<Option<f64>> {
            rounds.iter().map(|timing| Some(value(timing)).filter(|v| v.is_finite())).collect()
        };
        let min = |value: fn(&Timing) -> f64| {
            rounds.iter().map(value).filter(|v| v.is_finite()).min_by(f64::total_cmp)
        };
        let least_seconds = min(|t| t.min_seconds);
        let unit = min(|t| t.min_calibration_seconds);
        let mut results = StageResults {
            stage: key.stage,
            threads: key.threads as u32,
            camera: camera.map(str::to_string),
            width: key.size.map(|(width, _)| width),
            height: key.size.map(|(_, height)| height),
            rays: work.rays,
            hash: work.hash.map(|hash| hash.to_string()),
            nodes_per_ray: work.steps.map(|steps| steps.nodes),
            blocks_per_ray: work.steps.map(|steps| steps.blocks),
            triangles_per_ray: work.steps.map(|steps| steps.triangles),
            seconds: finite(|t| t.seconds),
            relative: finite(|t| t.relative),
            wall_seconds: finite(|t| t.wall_seconds),
            peak_bytes: rounds.iter().filter_map(|t| t.peak_bytes).map(Some).collect(),
            joules: finite(|t| t.joules),
            least_seconds,
            least_relative: least_seconds.zip(unit).map(|(seconds, unit)| seconds / unit),
            waited: median(rounds.iter().map(|timing| timing.wait_fraction)),
            median_seconds: None,
            median_relative: None,
            spread: None,
            mrays_per_second: None,
        };
        results.median_seconds = results.median();
        results.median_relative = median(results.relative());
        results.spread = results.relative_spread();
        results.mrays_per_second = results.mrays();
        results
    }

    /// Returns true if these are results of the same stage, camera, size and number of threads.
    pub fn is_same_stage(&self, other: &StageResults) -> bool {
        (self.stage, self.threads) == (other.stage, other.threads) && self.has_same_view(other)
    }

    /// Returns true if these are results of the same camera and size of images.
    pub fn has_same_view(&self, other: &StageResults) -> bool {
        (&self.camera, self.size()) == (&other.camera, other.size())
    }

    /// Width and height of the image in pixels, for stages that depend on its size.
    pub fn size(&self) -> Option<(u32, u32)> {
        self.width.zip(self.height)
    }

    /// The measurement in words: `eye, 640x360, 1 thread`.
    pub fn description(&self) -> String {
        let size = self.size().map(|(width, height)| format!(", {width}x{height}")).unwrap_or_default();
        let camera = self.camera.as_ref().map(|name| format!(" of {name}")).unwrap_or_default();
        let threads = if self.threads == 1 { "thread" } else { "threads" };
        format!("{}{camera}{size}, {} {threads}", self.stage.name(), self.threads)
    }

    /// Relative times of the rounds that have one.
    pub fn relative(&self) -> impl Iterator<Item = f64> {
        self.relative.iter().copied().flatten()
    }

    /// Standard deviation of the logarithms of the relative times.
    pub fn relative_spread(&self) -> Option<f64> {
        log_std_dev(self.relative())
    }

    /// Median time in seconds.
    pub fn median(&self) -> Option<f64> {
        median(self.seconds.iter().copied().flatten())
    }

    /// Millions of rays per second, from the median time.
    pub fn mrays(&self) -> Option<f64> {
        let rate = self.rays? as f64 / self.median()? * 1e-6;
        Some(rate).filter(|rate| rate.is_finite())
    }

    /// Median energy in joules.
    pub fn median_joules(&self) -> Option<f64> {
        median(self.joules.iter().copied().flatten())
    }

    /// Median of the peak memory in bytes.
    pub fn peak(&self) -> Option<f64> {
        median(self.peak_bytes.iter().flatten().map(|&bytes| bytes as f64))
    }
}

impl SceneResults {
    /// Adds the peak memory that another process has measured for this scene.
    pub fn add_memory(&mut self, other: &SceneResults) {
        for stage in &mut self.stages {
            if let Some(other) = other.stages.iter().find(|other| other.is_same_stage(stage)) {
                stage.peak_bytes.extend(&other.peak_bytes);
            }
        }
    }
}

impl BenchResults {
    /// Returns the scene of the same name as another run's, or else of the same file: its path may be another.
    pub(super) fn find_scene(&self, wanted: &SceneResults) -> Option<&SceneResults> {
        let has_same_file = |scene: &&SceneResults| scene.sha256.is_some() && scene.sha256 == wanted.sha256;
        let has_same_name = |scene: &&SceneResults| scene.name == wanted.name;
        self.scenes.iter().find(has_same_name).or_else(|| self.scenes.iter().find(has_same_file))
    }

    /// The version and the program in words: `blinn 0.1.0, x86_64-linux, rustc 1.92.0, commit 89abcdef, executable 01234567`.
    pub(super) fn program_name(&self) -> String {
        let Program { sha256, target, rustc, commit } = &self.program;
        let start = |hash: &String| hash.chars().take(8).collect::<String>();
        let mut parts = vec![format!("blinn {}", self.version)];
        parts.extend(Some(target.clone()).filter(|target| !target.is_empty()));
        let compiler: Vec<&str> = rustc.split_whitespace().take(2).collect();
        parts.extend(Some(compiler.join(" ")).filter(|compiler| !compiler.is_empty()));
        parts.extend(commit.as_ref().map(|commit| format!("commit {}", start(commit))));
        parts.extend(sha256.as_ref().map(|hash| format!("executable {}", start(hash))));
        parts.join(", ")
    }

    /// The results of a run that has just ended on this machine.
    pub(super) fn new(settings: RecordedSettings, scenes: Vec<SceneResults>) -> BenchResults {
        let since_epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        BenchResults {
            format: FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            program: Program::default(),
            unix_time: since_epoch.map_or(0, |duration| duration.as_secs()),
            machine: Machine::detect(),
            settings: RecordedSettings { calibration: Calibration::VERSION, ..settings },
            scenes,
        }
    }
}
