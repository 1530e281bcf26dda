//! Parsers of values that only the command line has. Their errors say which form is expected.

mod base_url;
mod bench;
mod counts;
mod dataset;
mod shards;
mod sheet_views;
mod views;

pub use base_url::{BaseUrl, base_url, host_name, split_port};
pub use bench::{ray_kind, sizes, thread_counts};
pub use counts::{distance_tolerance, frame_count, tolerance, triangle_counts};
pub use dataset::{CategoryRule, DatasetFormat, DatasetFormats, category_rule, dataset_formats};
pub use shards::{ShardSize, shard_size};
pub use sheet_views::{SheetView, SheetViews, sheet_views};
pub use views::{distance_range, elevation_range, roll, view_layout};

pub use blinn_session::values::{
    angle, axis, background, bytes, elevation, length_scale, number, positive, size,
};
