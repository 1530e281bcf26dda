//! Executes a plan: renders each scene, writes its files and reports progress.

pub(super) mod animation_writer;
pub(super) mod assemble;
pub(super) mod batch;
mod dataset;
mod dataset_files;
mod frame_files;
mod frame_filter;
mod golden_check;
pub(super) mod image_sink;
mod ledger;
mod limited_shards;
pub(super) mod load_scene;
mod malloc_tuning;
mod merged_dataset;
pub(super) mod panics;
pub(super) mod progress;
pub(super) mod render;
mod report;
mod report_section;
pub(super) mod runtime;
mod scene_job;
mod scene_ledger;
mod scene_task;
mod scenes;
mod shard_batch;
pub(super) mod signals;
mod watch;
