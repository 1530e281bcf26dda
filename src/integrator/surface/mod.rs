//! Surface points: from hits to positions, normals, texture coordinates and ray differentials.

pub(crate) mod hits_by_triangle;
pub(crate) mod mesh_triangle;
pub(crate) mod point_block;
pub(crate) mod points_soa;
pub(crate) mod ray_differentials;
pub(crate) mod shading_triangle;
pub(crate) mod shadow_terminator;
pub(crate) mod soa;
pub(crate) mod surface_hit;
pub(crate) mod surface_point;
pub(crate) mod texture_batch;
pub(crate) mod texture_eval;
pub(crate) mod triangle_plane;
