//! Benchmarks: the cost of loading, building, tracing, rendering and encoding on this machine, as results that can be
//! compared with a baseline from another day.
//!
//! Each measurement is interleaved with a fixed calibration loop ([`Calibration`]), round after round over all scenes.
//! The *relative* time of a stage is its time in units of that loop: a slow phase of the machine affects both. Time
//! that other programs had the processors is subtracted, if the system reports it. The spread of the rounds gives
//! [`compare()`] the threshold of a significant change.
//!
//! A [`WorkHash`] of the hits of each stage and of the pixels of each frame shows that rounds, numbers of threads, SIMD
//! levels and machines did the same work.
#![deny(unsafe_code)]
#![warn(missing_docs)]

mod bootstrap;
mod calibration;
mod camera;
mod compare;
mod cpu_wait;
mod energy;
mod interleaved_timer;
mod limited_file;
mod machine;
pub mod manifest;
mod measure;
pub mod npz;
mod ray_dump;
mod rays;
mod record;
mod report;
mod results;
mod results_file;
mod scene_round;
pub mod scenes;
mod settings;
mod stage;
mod stage_record;
mod stats;
mod trace;
mod work_hash;
mod workload;

pub use bootstrap::{Interval, ratio_interval};
pub use calibration::Calibration;
pub use camera::{BenchCamera, CameraPlacement};
pub use compare::{Change, Comparison, Verdict, compare};
pub use measure::{BenchRun, measure};
pub use ray_dump::{DumpSettings, RayDump, dump_rays};
pub use rays::{MeanSteps, RaySet, RaySets, TileBatch, TileRays};
pub use record::MeasureError;
pub use report::{
    HeatMap, MachineResults, Table, comparison_table, different_work, format_duration, machines_page,
    report_page, result_tables, results_csv, trace_csv, trace_page, trace_tables,
};
pub use results::{BenchResults, BvhResults, Machine, Program, RecordedSettings, SceneResults, StageResults};
pub use results_file::ResultsError;
pub use settings::{BenchObserver, BenchSettings};
pub use stage::BenchStage;
pub use trace::{SpanRange, SpeedUp, Trace, TraceBound, TraceError, TracedStage};
pub use work_hash::WorkHash;
pub use workload::{Workload, WorkloadError, remove_generated_scenes, standard_suite};
