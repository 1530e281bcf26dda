//! Executes a plan: renders each scene, writes its files and reports progress.

pub(super) mod animation_writer;
pub(super) mod assemble;
mod batch;
mod dataset;
mod dataset_files;
mod frame_files;
mod frame_filter;
mod golden_check;
pub(super) mod image_sink;
pub(super) mod imported_scene;
mod ledger;
mod limited_shards;
mod malloc_tuning;
pub(super) mod panics;
pub(super) mod progress;
pub(super) mod render;
mod report;
pub(super) mod runtime;
mod scene_job;
mod scene_ledger;
mod scenes;
mod shard_batch;
mod signals;
mod watch;
