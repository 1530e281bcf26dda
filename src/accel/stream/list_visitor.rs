//! Visitors of leaves, for traversal by streams.

use crate::stream::prepared_rays::PreparedRays;
use blinn_core::simd::Simd;

/// Intersects lists of rays with the contents of leaves.
pub(super) trait ListVisitor<S: Simd> {
    /// True for any-hit queries.
    const ANY_HIT: bool;

    /// Intersects rays with a leaf whose box they meet, and updates their limits.
    fn visit_leaf(&mut self, leaf: u32, rays: &[u32], prepared_rays: &mut PreparedRays);

    /// Prefetches a leaf.
    fn prefetch(&self, leaf: u32);
}
