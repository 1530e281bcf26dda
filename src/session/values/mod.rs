//! Parsers of option values. Their errors say which form is expected.

mod camera;
mod color;
mod image;
mod layer_names;
mod lights;
mod numbers;

pub use camera::{
    NAMED_DIRECTIONS, aperture_blades, aperture_radius, axis, clip, elevation, field_of_view, focus,
    intrinsics, orbit, shift, view_rect,
};
pub use color::color;
pub use image::{aovs, background, crop, exposure, gamma, image_background, size};
pub use layer_names::layer_hint;
pub use lights::{ao, area_light, lights, point_light, radius, strength, sun};
pub use numbers::{
    angle, bytes, depth_unit, direction, exactly, fraction, glob, length_scale, number, numbers, positive,
    smooth, vector, whole,
};
