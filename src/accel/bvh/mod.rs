//! The BVH's data: eight-wide nodes, leaves of four triangles, and the two levels (BLAS and TLAS).

pub(crate) mod aabb;
pub(crate) mod blas;
pub(crate) mod build_triangle;
pub(crate) mod bvh8;
pub(crate) mod canonical_triangle;
pub(crate) mod coincident;
pub(crate) mod huge_pages;
pub(crate) mod instance;
pub(crate) mod occlusion_order;
pub(crate) mod sah;
pub(crate) mod scene_bvh;
pub(crate) mod surface_flags;
pub(crate) mod tlas;
pub(crate) mod triangle4;
pub(crate) mod triangle_ids;
