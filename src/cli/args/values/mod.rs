//! Parsers of option values. Their errors say which form is expected.

mod camera;
mod dataset;
mod image;
mod lights;
mod numbers;
mod shards;
mod views;

pub use camera::{axis, clip, elevation, field_of_view, intrinsics, orbit, shift, view_rect};
pub use dataset::{CategoryRule, DatasetFormat, DatasetFormats, category_rule, dataset_formats};
pub use image::{
    BackgroundArg, aovs, background, color, crop, exposure, image_background, ray_kind, size, sizes,
};
pub use lights::{HdriArg, ao, hdri, lights, point_light, radius, strength, sun};
pub use numbers::{
    angle, bytes, depth_unit, direction, fraction, frame_count, glob, number, positive, smooth, tolerance,
    triangle_counts, vector,
};
pub use shards::{ShardSize, shard_size};
pub use views::{distance_range, elevation_range, roll, view_layout};
