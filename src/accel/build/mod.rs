//! BVH construction: input triangles, clusters, the obvhs builder, conversion to eight-wide nodes, refit.

pub(crate) mod builder;
pub(crate) mod bvh2_to_bvh8;
pub(crate) mod canonical_triangle;
pub(crate) mod cluster_prims;
pub(crate) mod duplicate_filter;
pub(crate) mod input_triangles;
pub(crate) mod instancing_plan;
pub(crate) mod leaf_packing;
pub(crate) mod morton_clusters;
pub(crate) mod occlusion_order;
pub(crate) mod refit;
pub(crate) mod scene_triangles;
pub(crate) mod surface_flags;
