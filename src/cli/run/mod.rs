//! Executes a plan: renders each scene, writes its files, reports progress.

pub(crate) mod animation_writer;
pub(crate) mod assemble;
pub(crate) mod dataset;
pub(crate) mod framed;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(crate) mod malloc_tuning;
pub(crate) mod metering;
pub(crate) mod panics;
pub(crate) mod progress;
pub(crate) mod render;
pub(crate) mod report;
pub(crate) mod scene_job;
pub(crate) mod sequence;
pub(crate) mod session;
pub(crate) mod signals;
