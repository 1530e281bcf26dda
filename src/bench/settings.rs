//! Settings of a benchmark run, and the interface that receives its progress.

use std::path::PathBuf;

use super::stage::BenchStage;
use super::workload::Workload;
use blinn_accel::SimdLevel;
use blinn_import::{LoadOptions, Warning};
use blinn_render::RenderSettings;

/// Settings of a benchmark run.
#[derive(Clone, Debug)]
pub struct BenchSettings {
    /// How files are imported.
    pub load: LoadOptions,
    /// Converts .blend files, as [`blinn_session::load_scene`] says.
    pub blender: Option<PathBuf>,
    /// Sampling of frames. Rays go through the pixel centres.
    pub render: RenderSettings,
    /// Widths and heights of the images in pixels; they replace those of `render`.
    pub sizes: Vec<(u32, u32)>,
    /// Rounds over all scenes.
    pub rounds: u32,
    /// Seconds for which a stage is repeated in each round, at least.
    pub min_seconds: f64,
    /// The stages to measure; the others run only where these need their results.
    pub stages: Vec<BenchStage>,
    /// Numbers of threads.
    pub threads: Vec<usize>,
    /// The SIMD level of ray traversal.
    pub simd: SimdLevel,
    /// True if heat maps of the eye rays' traversal steps are rendered.
    pub heat_maps: bool,
    /// Measures peak memory instead of time, with a single run of each stage. A process keeps memory of earlier work,
    /// so it must not measure anything before.
    pub memory: bool,
    /// The command line, which the results record.
    pub command: Vec<String>,
}

/// Receives the progress of a run.
pub trait BenchObserver {
    /// A round of a scene starts.
    fn scene_started(&mut self, workload: &Workload, round: u32);
    /// A scene has been imported with these warnings. Called once per scene.
    ///
    /// # Errors
    /// The scene must not be measured.
    fn scene_loaded(&mut self, workload: &Workload, warnings: &[Warning]) -> Result<(), String>;
    /// Returns true if no further round of a scene should start. The results are those of the rounds so far.
    fn is_stopped(&self) -> bool {
        false
    }
}
