//! Surface points: from hits to positions, normals, texture coordinates and ray differentials.
//!
//! A hit passes through these types:
//!
//! - `Hit`: distance and triangle, as [`Accel::intersect`](blinn_accel::Accel::intersect) returns it.
//! - [`PathRayHit`](crate::integrator::path_rays::PathRayHit): a hit with its ray and the index of its path.
//! - [`PlaneHit`](triangle_plane::PlaneHit): the ray where it crosses the plane of the triangle, with barycentrics.
//! - [`SurfaceHit`](surface_hit::SurfaceHit): position, normals, ray origin and footprint; the geometry that shading needs.
//!   [`PointBlock`](point_block::PointBlock) stores it as structure of arrays.
//! - [`ShadingPoint`](crate::integrator::shading_batch::ShadingPoint): path, triangle and coefficients of a
//!   point in a block.
//! - [`SurfacePoint`](surface_point::SurfacePoint): a single point with its material and textures, for normal maps, AOVs and
//!   mattes. [`FirstHit`](crate::integrator::FirstHit) is the one that AOVs show.

pub(crate) mod bump_shadowing;
pub(crate) mod highlights;
pub(crate) mod hits_by_triangle;
pub(crate) mod mesh_triangle;
pub(crate) mod point_block;
pub(crate) mod points_soa;
pub(crate) mod ray_differentials;
pub(crate) mod round_hit;
pub(crate) mod shading_triangle;
pub(crate) mod shadow_terminator;
pub(crate) mod soa;
pub(crate) mod specular_normal;
pub(crate) mod surface_hit;
pub(crate) mod surface_point;
pub(crate) mod texel_batch;
pub(crate) mod texture_eval;
pub(crate) mod triangle_plane;
