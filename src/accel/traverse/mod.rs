//! Single-ray traversal: the conservative and the exact hit test, closest-hit and any-hit queries, transmittance,
//! statistics.

pub(crate) mod box_test;
pub(crate) mod bvh8_traversal;
pub(crate) mod conservative_triangle_test;
pub(crate) mod error_bounds;
pub(crate) mod exact_triangle_test;
pub(crate) mod query;
pub(crate) mod translucent_hits;
pub(crate) mod traversal_stats;
