//! The figures of a run, as they are kept in a file: JSON, one object.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::calibration::Calibration;
use super::stats::{log_std_dev, median};
use crate::bench::interleaved_timer::Timing;

/// What such a file says that it is.
const FORMAT: &str = "blinn bench 1";
/// Bytes of such a file, at most.
const MOST_BYTES: u64 = 256 << 20;

/// All figures of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BenchResults {
    /// `blinn bench 1`.
    pub format: String,
    /// blinn's version.
    pub version: String,
    /// When it ended, in seconds since 1970.
    #[serde(default)]
    pub unix_time: u64,
    /// Where it ran.
    pub machine: Machine,
    /// How it was measured.
    pub settings: RecordedSettings,
    /// What was measured.
    pub scenes: Vec<SceneResults>,
}

/// A machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Machine {
    /// The processor's name.
    pub cpu: String,
    /// Processors, as the system counts them.
    pub cores: u32,
    /// Bytes of memory.
    pub memory_bytes: u64,
    /// The system's name and version.
    pub os: String,
    /// The kernel's version.
    pub kernel: String,
    /// The widest instructions that blinn finds here.
    pub simd: String,
}

/// What decides figures beside scene and machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RecordedSettings {
    /// The command line's words.
    pub command: Vec<String>,
    /// Pixels to the right.
    pub width: u32,
    /// Pixels downwards.
    pub height: u32,
    /// Samples a pixel, of whole frames.
    pub samples: u32,
    /// Rounds over all scenes.
    pub rounds: u32,
    /// Numbers of threads.
    pub threads: Vec<u32>,
    /// The instructions that rays were traced with.
    pub simd: String,
    /// [`Calibration::VERSION`]: relative times compare only where it is the same.
    pub calibration: u32,
    /// True of a build without optimisation.
    pub debug_build: bool,
}

/// The figures of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SceneResults {
    /// `scan 70k`, or a file's name.
    pub name: String,
    /// Triangles as drawn.
    #[serde(default)]
    pub triangles: u64,
    /// Its trees.
    #[serde(default)]
    pub tree: Option<BvhResults>,
    /// Its stages, each for every number of threads.
    #[serde(default)]
    pub stages: Vec<StageResults>,
}

/// Trees over triangles: the same on every machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct BvhResults {
    /// Inner nodes.
    pub nodes: u64,
    /// Triangles in trees: shared and coincident ones count once.
    pub entries: u64,
    /// Bytes.
    pub bytes: u64,
    /// Bytes for each of those triangles.
    pub bytes_per_triangle: Option<f64>,
    /// [`crate::accel::Accel::sah_cost`].
    pub sah_cost: Option<f64>,
}

/// Something that is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BenchStage {
    /// A file to a scene.
    Load,
    /// A scene to trees.
    Build,
    /// Closest hits of rays through pixels' centres.
    Eye,
    /// Whether anything is between each of those hits and a point light.
    Shadow,
    /// Closest hits of a ray from each of those hits to anywhere above it, by the cosine.
    Incoherent,
    /// A whole picture: rays, shading, film.
    Frame,
    /// A picture to a PNG's bytes.
    Encode,
}

impl BenchStage {
    /// All of them, in their order.
    pub const ALL: [BenchStage; 7] = [
        BenchStage::Load,
        BenchStage::Build,
        BenchStage::Eye,
        BenchStage::Shadow,
        BenchStage::Incoherent,
        BenchStage::Frame,
        BenchStage::Encode,
    ];

    /// Its name, as in files.
    pub fn name(self) -> &'static str {
        match self {
            BenchStage::Load => "load",
            BenchStage::Build => "build",
            BenchStage::Eye => "eye",
            BenchStage::Shadow => "shadow",
            BenchStage::Incoherent => "incoherent",
            BenchStage::Frame => "frame",
            BenchStage::Encode => "encode",
        }
    }
}

/// A stage's figures. What is missing, or was no number, is null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageResults {
    /// Which.
    pub stage: BenchStage,
    /// On how many threads.
    pub threads: u32,
    /// BenchRays, where it is nothing else.
    #[serde(default)]
    pub rays: Option<u64>,
    /// Seconds of each round: the median of its turns, without waiting for a processor.
    #[serde(default)]
    pub seconds: Vec<Option<f64>>,
    /// The same in units of the calibration, timed by turns with it.
    #[serde(default)]
    pub relative: Vec<Option<f64>>,
    /// The most bytes that a process had meanwhile that measured nothing else.
    #[serde(default)]
    pub peak_bytes: Vec<Option<u64>>,
    /// Seconds of the quickest turn of all rounds.
    #[serde(default)]
    pub least_seconds: Option<f64>,
    /// The same in units of the calibration at its quickest. On one thread two runs agree about it better than about
    /// medians; on several it is luck.
    #[serde(default)]
    pub least_relative: Option<f64>,
    /// Share of the time that other programs had the processors: the median round's.
    #[serde(default)]
    pub waited: Option<f64>,
    /// Median of `seconds`. These four are said for readers; blinn computes them anew.
    #[serde(default)]
    pub median_seconds: Option<f64>,
    /// Median of `relative`.
    #[serde(default)]
    pub median_relative: Option<f64>,
    /// Standard deviation of the logarithms of `relative`.
    #[serde(default)]
    pub spread: Option<f64>,
    /// Millions of rays a second, by the median.
    #[serde(default)]
    pub mrays_per_second: Option<f64>,
}

impl StageResults {
    /// Of the rounds' outcomes.
    pub(super) fn of(
        stage: BenchStage,
        threads: usize,
        rays: Option<u64>,
        rounds: &[Timing],
    ) -> StageResults {
        let finite = |value: fn(&Timing) -> f64| -> Vec<Option<f64>> {
            rounds.iter().map(|taken| Some(value(taken)).filter(|v| v.is_finite())).collect()
        };
        let least = |value: fn(&Timing) -> f64| {
            rounds.iter().map(value).filter(|v| v.is_finite()).min_by(f64::total_cmp)
        };
        let mut figures = StageResults {
            stage,
            threads: threads as u32,
            rays,
            seconds: finite(|t| t.seconds),
            relative: finite(|t| t.relative),
            peak_bytes: rounds.iter().filter_map(|t| t.peak_bytes).map(Some).collect(),
            least_seconds: least(|t| t.least),
            least_relative: least(|t| t.least).zip(least(|t| t.least_workload)).map(|(of, unit)| of / unit),
            waited: median(rounds.iter().map(|taken| taken.waited)),
            median_seconds: None,
            median_relative: None,
            spread: None,
            mrays_per_second: None,
        };
        figures.median_seconds = figures.median();
        figures.median_relative = median(figures.relative());
        figures.spread = figures.spread_of_rounds();
        figures.mrays_per_second = figures.mrays();
        figures
    }

    /// Relative times of the rounds that have one.
    pub fn relative(&self) -> impl Iterator<Item = f64> {
        self.relative.iter().copied().flatten()
    }

    /// How much the rounds' relative times differ, as a share.
    pub fn spread_of_rounds(&self) -> Option<f64> {
        log_std_dev(self.relative())
    }

    /// Seconds, by the median.
    pub fn median(&self) -> Option<f64> {
        median(self.seconds.iter().copied().flatten())
    }

    /// Millions of rays a second, by the median.
    pub fn mrays(&self) -> Option<f64> {
        let rate = self.rays? as f64 / self.median()? * 1e-6;
        Some(rate).filter(|rate| rate.is_finite())
    }

    /// The most memory, by the median.
    pub fn peak(&self) -> Option<f64> {
        median(self.peak_bytes.iter().flatten().map(|&bytes| bytes as f64))
    }
}

impl SceneResults {
    /// Takes the memory from what another process found of the same scene.
    pub fn add_memory(&mut self, from: &SceneResults) {
        for stage in &mut self.stages {
            let same = |other: &&StageResults| (other.stage, other.threads) == (stage.stage, stage.threads);
            if let Some(other) = from.stages.iter().find(same) {
                stage.peak_bytes.extend(&other.peak_bytes);
            }
        }
    }
}

impl BenchResults {
    pub(super) fn new(settings: RecordedSettings, scenes: Vec<SceneResults>) -> BenchResults {
        let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        BenchResults {
            format: FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            unix_time: since.map_or(0, |since| since.as_secs()),
            machine: Machine::here(),
            settings: RecordedSettings { calibration: Calibration::VERSION, ..settings },
            scenes,
        }
    }

    /// As a file's text.
    pub fn to_json(&self) -> String {
        // Nothing in here can fail: no map has keys that are no text.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// Reads a file of an earlier run.
    ///
    /// # Errors
    /// What keeps it from being read, and where.
    pub fn read(path: &Path) -> Result<BenchResults, ResultsError> {
        let error = |what: String| ResultsError { file: path.display().to_string(), what };
        let length = std::fs::metadata(path).map_err(|e| error(e.to_string()))?.len();
        if length > MOST_BYTES {
            return Err(error(format!("{length} bytes are too many for figures of 'blinn bench'")));
        }
        let text = std::fs::read(path).map_err(|e| error(e.to_string()))?;
        BenchResults::parse(&text).map_err(error)
    }

    /// Reads the text of such a file.
    ///
    /// # Errors
    /// What keeps it from being read.
    pub fn parse(text: &[u8]) -> Result<BenchResults, String> {
        /// What tells such a file from others.
        #[derive(Deserialize)]
        struct Head {
            format: String,
        }
        const MADE: &str = "make one with: blinn bench SCENE --json FILE";
        let foreign = |e: serde_json::Error| match e.classify() {
            serde_json::error::Category::Data => format!("these are no figures of 'blinn bench' ({MADE})"),
            _ => format!("{e}: the file is damaged or no JSON ({MADE})"),
        };
        let head: Head = serde_json::from_slice(text).map_err(foreign)?;
        if head.format != FORMAT {
            let format: String = head.format.chars().take(40).collect();
            return Err(format!("these are figures of the format '{format}', not '{FORMAT}' ({MADE})"));
        }
        let mut json = serde_json::Deserializer::from_slice(text);
        serde_path_to_error::deserialize(&mut json).map_err(|e| format!("at {}: {}", e.path(), e.inner()))
    }
}

/// A file of figures that cannot be read, in one line.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {what}")]
pub struct ResultsError {
    file: String,
    what: String,
}
