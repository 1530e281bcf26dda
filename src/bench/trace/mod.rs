//! The speed-up that more cores could give a job, from traces of it (`blinn render --trace`).

mod bound;
mod file;
mod job;

pub use bound::{SpanRange, SpeedUp, TraceBound, TracedStage};
pub use file::{Trace, TraceError};
