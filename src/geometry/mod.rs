//! Rays, hits, frames, bounds, transforms and the error bounds that keep them honest.
//!
//! Everything here is plain arithmetic: no scene, no files, no threads.

mod basis;
mod bounds;
mod error;
mod hit;
mod power;
mod sampling;
mod transform;

pub use basis::{Basis, coordinate_system};
pub use bounds::{Aabb, Sphere};
pub use error::{EPSILON, offset_point, point_error};
pub use hit::{Hit, HitId, Ray, RayDifferential};
pub use power::power_below_one;
pub use sampling::{concentric_disc, cosine_hemisphere};
pub use transform::{Transform, cofactor};

/// Linear RGB, Rec. 709 primaries.
pub type Rgb = glam::Vec3;
/// Linear RGB with alpha; whether premultiplied is said where it is used.
pub type Rgba = glam::Vec4;
