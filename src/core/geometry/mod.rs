//! Geometric primitives: rays, hits, bounding boxes, frames, transforms, sampling and rounding-error
//! bounds.
//!
//! Everything here is arithmetic. It knows no scene, no files and no threads.

mod aabb;
mod basis;
mod hit;
mod morton;
mod polynomial;
mod power;
mod rounding_error;
mod sampling;
mod transform;
mod trigonometry;

pub use aabb::{Aabb, Sphere};
pub use basis::{Basis, coordinate_system};
pub use hit::{Hit, HitId, Ray, RayDifferential};
pub use morton::{decode_morton2, morton2, morton3};
pub use power::pow_one_minus;
pub use rounding_error::{EPSILON, offset_ray_origin, point_error};
pub use sampling::{concentric_disc, cosine_hemisphere, golden_angle};
pub use transform::{Transform, cofactor};
pub use trigonometry::cos_sin_of_turns;

/// Linear RGB, Rec. 709 primaries.
pub type Rgb = glam::Vec3;
/// Linear RGB with alpha. Each use says whether it is premultiplied.
pub type Rgba = glam::Vec4;
