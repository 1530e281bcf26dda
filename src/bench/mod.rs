//! Measuring: what reading a scene, its trees, rays, whole frames and files cost on this machine, in
//! figures that can be compared with those of another day.
//!
//! Everything is timed by turns with a fixed workload ([`Calibration`]), round after round over all
//! scenes. What a stage takes in units of that workload is its *relative* time: where the machine is slow
//! for a while, both are. Time that other programs had the processors is taken off, as far as the system
//! tells it. How much rounds differ is the noise that [`compare()`] goes by.

mod calibration;
mod compare;
mod cpu_wait;
mod interleaved_timer;
mod machine;
mod measure;
pub mod memory;
mod rays;
mod report;
mod results;
pub mod scenes;
mod stats;
mod workload;

pub use calibration::Calibration;
pub use compare::{Change, Comparison, Verdict, compare};
pub use measure::{BenchObserver, BenchRun, BenchSettings, MeasureError, measure};
pub use rays::BenchRays;
pub use report::{HeatMap, format_duration, report_page};
pub use results::{
    BenchResults, BenchStage, BvhResults, Machine, RecordedSettings, ResultsError, SceneResults, StageResults,
};
pub use workload::{Workload, WorkloadError, remove_generated_scenes, standard_suite};
