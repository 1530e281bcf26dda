//! BVH construction: input triangles, Morton clusters, the SAH builder, eight-wide conversion, refit.

pub(crate) mod blas_builder;
mod builder;
mod bvh2_to_bvh8;
pub(crate) mod canonical_triangle;
mod cluster_prims;
mod duplicate_filter;
pub(crate) mod input_triangles;
pub(crate) mod instancing_plan;
mod leaf_packing;
mod morton_clusters;
pub(crate) mod occlusion_order;
mod refit;
pub(crate) mod scene_triangles;
mod subtree;
pub(crate) mod surface_flags;
pub(crate) mod tlas_builder;
