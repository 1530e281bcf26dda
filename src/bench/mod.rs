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
mod figures;
mod interleaved_timer;
mod machine;
mod measure;
pub mod memory;
mod page;
mod rays;
pub mod scenes;
mod stats;
mod subject;

pub use calibration::Calibration;
pub use compare::{Change, Comparison, Verdict, compare};
pub use figures::{Figures, FiguresError, Machine, SceneFigures, Settings, Stage, StageFigures, TreeFigures};
pub use measure::{Listener, MeasureError, Measurement, Plan, measure};
pub use page::{HeatMap, duration, page};
pub use rays::Rays;
pub use subject::{Subject, SubjectError, suite, sweep};
