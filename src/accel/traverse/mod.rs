//! Single-ray traversal: the conservative and the exact hit test, closest-hit and any-hit queries, transmittance,
//! statistics.

pub(crate) mod box_test;
pub(crate) mod bvh8_traversal;
pub(crate) mod error_bounds;
pub(crate) mod hit;
pub(crate) mod query;
pub(crate) mod transmittance;
pub(crate) mod traversal_stats;
pub(crate) mod triangle_test;
