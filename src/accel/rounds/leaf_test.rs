//! Tests of a ray against all items of a leaf, and of a packet against one, which leave few for exact tests.

use super::box_test::BoxTest;
use super::items::{PointItem, RoundItem, SegmentItem};
use super::packet::RoundPacket;
use super::round_bvh::{RoundNode, WIDTH};
use blinn_core::simd::Simd;

/// Items of leaves.
pub(super) trait LeafItem: RoundItem {
    /// Returns a bit for each item of a leaf that a ray may enter at a t of at most `limit`.
    fn near(items: &[Self], test: &BoxTest, limit: f32) -> u32;

    /// Returns a bit for each ray of a packet that may enter the item up to its limit.
    fn near_rays<S: Simd>(&self, packet: &RoundPacket<S>) -> u32;
}

impl LeafItem for PointItem {
    #[inline(always)]
    fn near(items: &[PointItem], test: &BoxTest, _limit: f32) -> u32 {
        let mut p = [[0.0; WIDTH]; 3];
        for (i, item) in items.iter().take(WIDTH).enumerate() {
            [p[0][i], p[1][i], p[2][i]] = item.p.to_array();
        }
        test.near_points(&p) & ((1u32 << items.len()) - 1)
    }

    #[inline(always)]
    fn near_rays<S: Simd>(&self, packet: &RoundPacket<S>) -> u32 {
        packet.near_point(self.p)
    }
}

impl LeafItem for SegmentItem {
    #[inline(always)]
    fn near(items: &[SegmentItem], test: &BoxTest, limit: f32) -> u32 {
        let mut node = RoundNode::EMPTY;
        items.iter().take(WIDTH).enumerate().for_each(|(i, item)| node.set(i, item.bounds()));
        let near = test.near(&node);
        // False for NaN.
        (0..WIDTH).fold(0u32, |mask, i| mask | u32::from(near[i] <= limit) << i)
    }

    #[inline(always)]
    fn near_rays<S: Simd>(&self, packet: &RoundPacket<S>) -> u32 {
        packet.near_segment(self.a, self.b)
    }
}
