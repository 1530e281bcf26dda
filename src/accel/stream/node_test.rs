//! Ray–box test: the rays of a list against the eight child boxes of a node, one after the other.

use crate::bvh::bvh8::Bvh8Node;
use crate::stream::lists::MASKS;
use crate::stream::prepared_rays::{BoxTestData, STREAM_RAYS};
use crate::traverse::box_test::NEAR_FACTOR;
use blinn_core::simd::{Lanes, Simd};

/// The planes of a node by which rays of an octant enter boxes, and those by which they leave them.
#[derive(Clone, Copy)]
pub(super) struct NodePlanes<S: Simd> {
    near: [S::F32x8; 3],
    far: [S::F32x8; 3],
}

impl<S: Simd> NodePlanes<S> {
    #[inline(always)]
    pub fn new(node: &Bvh8Node, octant: usize) -> Self {
        let planes = |axis: usize, side: usize| S::F32x8::load(&node.planes[axis][side & 1]);
        let [x, y, z] = [octant, octant >> 1, octant >> 2];
        NodePlanes {
            near: [planes(0, !x), planes(1, !y), planes(2, !z)],
            far: [planes(0, x), planes(1, y), planes(2, z)],
        }
    }
}

impl BoxTestData {
    /// Returns where the ray enters each child box, and where it leaves it or reaches its limit.
    #[inline(always)]
    pub fn intervals<S: Simd>(&self, planes: &NodePlanes<S>) -> (S::F32x8, S::F32x8) {
        let splat = S::F32x8::splat;
        let near =
            |axis: usize| planes.near[axis].mul_sub(splat(self.scale[axis]), splat(self.near_shift[axis]));
        let far =
            |axis: usize| planes.far[axis].mul_sub(splat(self.scale[axis]), splat(self.far_shift[axis]));
        let enter = near(0).max(near(1)).max(near(2).max(splat(self.t_min)));
        let exit = far(0).min(far(1)).min(far(2).min(splat(self.limit)));
        (enter * splat(NEAR_FACTOR), exit)
    }
}

/// Finds the children that each ray of a list meets. Rays are sorted by octant.
#[inline(always)]
pub(super) fn test_boxes<S: Simd>(
    node: &Bvh8Node,
    boxes: &[BoxTestData; STREAM_RAYS],
    rays: &[u32],
    masks: &mut [u8; MASKS],
) {
    let Some(&first) = rays.first() else { return };
    let mut octant = boxes[first as usize & (STREAM_RAYS - 1)].octant();
    let mut planes = NodePlanes::<S>::new(node, octant);
    for (&ray, mask) in rays.iter().zip(masks) {
        let test_data = &boxes[ray as usize & (STREAM_RAYS - 1)];
        if test_data.octant() != octant {
            octant = test_data.octant();
            planes = NodePlanes::new(node, octant);
        }
        let (enter, exit) = test_data.intervals::<S>(&planes);
        *mask = enter.le(exit) as u8;
    }
}
