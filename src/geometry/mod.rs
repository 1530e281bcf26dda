//! Rays, hits, frames, bounds, transforms and the error bounds that keep them honest.
//!
//! Everything here is plain arithmetic: no scene, no files, no threads.

mod aabb;
mod basis;
mod hit;
mod morton;
mod power;
mod rounding_error;
mod sampling;
mod transform;

pub use aabb::{Aabb, Sphere};
pub use basis::{Basis, coordinate_system};
pub use hit::{Hit, HitId, Ray, RayDifferential};
pub(crate) use morton::{morton2, morton3};
pub use power::pow_one_minus;
pub use rounding_error::{EPSILON, offset_ray_origin, point_error};
pub use sampling::{concentric_disc, cosine_hemisphere};
pub use transform::{Transform, cofactor};

/// Linear RGB, Rec. 709 primaries.
pub type Rgb = glam::Vec3;
/// Linear RGB with alpha; whether premultiplied is said where it is used.
pub type Rgba = glam::Vec4;
