//! BVH construction: input triangles, Morton clusters, the SAH builder, eight-wide conversion, refit.

pub(crate) mod blas_builder;
mod builder;
mod bvh2_to_bvh8;
mod cluster_triangles;
mod duplicate_filter;
pub(crate) mod input_triangles;
pub(crate) mod instancing_plan;
mod leaf_groups;
mod leaf_packing;
pub(crate) mod mesh_flags;
mod morton_clusters;
mod refit;
pub(crate) mod scene_triangles;
mod subtree;
pub(crate) mod tlas_builder;
