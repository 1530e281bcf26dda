//! Executes a plan: renders each scene, writes its files and reports progress.

pub(super) mod animation_writer;
pub(super) mod assemble;
mod batch;
mod dataset;
mod dataset_files;
mod depth_range;
pub(super) mod empty_images;
mod frame_files;
pub(super) mod framing;
mod golden_check;
mod ledger;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod limited_shards;
mod malloc_tuning;
pub(super) mod memory_estimate;
pub(super) mod metering;
mod neighbour_frames;
pub(super) mod panics;
pub(super) mod posed_frame;
pub(super) mod progress;
pub(super) mod render;
mod report;
pub(super) mod runtime;
pub(super) mod scene_job;
mod scene_ledger;
mod scenes;
pub(super) mod session;
mod shard_batch;
mod signals;
mod watch;
