//! Morton clusters: splits boxes into clusters of neighbours along the Z-order curve.
//!
//! Boxes are sorted by the Morton codes of their centres, and the curve is cut at the borders of its cells until
//! each cluster is small enough. So a cluster's centres share a region of space with no other cluster, and a
//! processor core's cache holds all of it.

use std::ops::Range;

use glam::{UVec3, Vec3};
use obvhs::aabb::Aabb as ObvhsAabb;
use rayon::prelude::*;
use rdst::RadixSort;

use crate::bvh::aabb::Aabb;
use blinn_core::geometry::morton3;

/// Bits of a box's index. That of a triangle shares 32 bits with the marks of leaf entries.
pub(crate) const INDEX_BITS: u32 = 30;

/// Bits of a cell's coordinate on each axis.
const CELL_BITS: u32 = 11;

/// A box: its Morton code in the high bits and its index in the low ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct MortonKey(u64);

impl MortonKey {
    /// A key of a box that is not in a cell yet.
    pub fn new(index: usize) -> MortonKey {
        MortonKey(index as u64)
    }

    /// The index of the box.
    pub fn index(self) -> usize {
        (self.0 & ((1 << INDEX_BITS) - 1)) as usize
    }

    /// The Morton code of the cell. Boxes in different cells have different centres, those in one cell may.
    pub fn cell(self) -> u64 {
        self.0 >> INDEX_BITS
    }
}

impl rdst::RadixKey for MortonKey {
    const LEVELS: usize = 8;

    fn get_level(&self, level: usize) -> u8 {
        (self.0 >> (8 * level)) as u8
    }
}

/// Clusters of boxes, in the order of the curve. They depend on the boxes only.
pub(crate) struct MortonClusters {
    keys: Vec<MortonKey>,
    clusters: Vec<Range<usize>>,
}

/// A range of keys that has to be split if it is too long.
struct RangeToSplit {
    range: Range<usize>,
    /// True if the keys are sorted by their cells.
    sorted: bool,
}

impl MortonClusters {
    /// Makes clusters of at most `max_size` boxes of `keys`; of more where all have the same centre. `bounds` returns the
    /// box with an index.
    pub fn new(
        mut keys: Vec<MortonKey>,
        bounds: impl Fn(usize) -> ObvhsAabb + Sync,
        max_size: usize,
    ) -> MortonClusters {
        let mut clusters = Vec::new();
        let mut stack = vec![RangeToSplit { range: 0..keys.len(), sorted: false }];
        while let Some(RangeToSplit { range, sorted }) = stack.pop() {
            let keys = &mut keys[range.clone()];
            if !sorted {
                sort_by_cell(&bounds, keys);
            }
            let (Some(first), Some(last)) = (keys.first(), keys.last()) else { break };
            let difference = first.cell() ^ last.cell();
            if keys.len() <= max_size || (!sorted && difference == 0) {
                clusters.push(range);
            } else if difference == 0 {
                // Too many boxes in one cell: sort them by smaller cells.
                stack.push(RangeToSplit { range, sorted: false });
            } else {
                let bit = difference.ilog2();
                let middle = range.start + keys.partition_point(|key| key.cell() >> bit & 1 == 0);
                stack.push(RangeToSplit { range: middle..range.end, sorted: true });
                stack.push(RangeToSplit { range: range.start..middle, sorted: true });
            }
        }
        MortonClusters { keys, clusters }
    }

    /// Number of clusters.
    pub fn len(&self) -> usize {
        self.clusters.len()
    }

    /// The boxes of each cluster, sorted by cell.
    pub fn par_iter(&self) -> impl IndexedParallelIterator<Item = &[MortonKey]> {
        self.clusters.par_iter().map(|cluster| &self.keys[cluster.clone()])
    }
}

/// Sorts boxes by the Morton codes of their centres in a grid over all of them. All are in one cell only where they
/// have the same centre.
fn sort_by_cell(bounds: &(impl Fn(usize) -> ObvhsAabb + Sync), keys: &mut [MortonKey]) {
    let centre = |key: &MortonKey| {
        let aabb = bounds(key.index());
        Vec3::from(0.5 * (aabb.min + aabb.max))
    };
    let centres = keys.par_iter().with_min_len(1 << 12).map(centre);
    let bounds = centres.map(|p| Aabb { min: p, max: p }).reduce(|| Aabb::EMPTY, Aabb::union);
    // Cells are cubes.
    let size = (bounds.max - bounds.min).max_element();
    let last = UVec3::splat((1 << CELL_BITS) - 1);
    keys.par_iter_mut().with_min_len(1 << 12).for_each(|key| {
        let relative = if size > 0.0 { (centre(key) - bounds.min) / size } else { Vec3::ZERO };
        let cell = (relative * (1u32 << CELL_BITS) as f32).as_uvec3().min(last);
        *key = MortonKey(morton3(cell) << INDEX_BITS | key.index() as u64);
    });
    keys.radix_sort_unstable();
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::*;

    fn cubes(centres: impl Iterator<Item = [f32; 3]>) -> Vec<ObvhsAabb> {
        let cube = |c: [f32; 3]| ObvhsAabb { min: Vec3A::from(c) - 0.5, max: Vec3A::from(c) + 0.5 };
        centres.map(cube).collect()
    }

    fn clusters(boxes: &[ObvhsAabb], max_size: usize) -> MortonClusters {
        MortonClusters::new((0..boxes.len()).map(MortonKey::new).collect(), |i| boxes[i], max_size)
    }

    fn indices(clusters: &MortonClusters) -> Vec<Vec<usize>> {
        clusters.par_iter().map(|keys| keys.iter().map(|key| key.index()).collect()).collect()
    }

    #[test]
    fn every_box_is_in_one_cluster_and_none_is_too_large() {
        // A dense group of a millionth of the scene's size, which is in one cell at first.
        let near = (0..3000u32).map(|i| [i % 20, i / 20 % 20, i / 400].map(|x| x as f32));
        let far = (0..50u32).map(|i| [i as f32 * 2e6, 0.0, -1e8]);
        let boxes = cubes(near.chain(far));
        for max_size in [1, 7, 100, 5000] {
            let clusters = indices(&self::clusters(&boxes, max_size));
            assert!(clusters.iter().all(|cluster| (1..=max_size).contains(&cluster.len())));
            let mut all = clusters.concat();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..boxes.len()));
        }
        assert!(indices(&clusters(&boxes, 100)).len() < 150);
    }

    #[test]
    fn boxes_with_the_same_centre_stay_together() {
        let boxes = cubes((0..900u32).map(|i| [(i % 3) as f32, 0.0, 0.0]));
        let clusters = indices(&self::clusters(&boxes, 100));
        assert_eq!(clusters.len(), 3);
        assert!(clusters.iter().all(|cluster| cluster.iter().all(|i| i % 3 == cluster[0] % 3)));
        assert_eq!(self::clusters(&boxes[..1], 100).len(), 1);
        assert_eq!(self::clusters(&boxes[..0], 100).len(), 0);
    }

    #[test]
    fn the_largest_and_the_smallest_scenes_are_split() {
        for scale in [1e-44f32, 1e-30, 1e18] {
            let p = |i: u32| Vec3A::from([i as f32 * scale / 100.0, 0.0, 0.0]);
            let boxes: Vec<ObvhsAabb> = (0..100).map(|i| ObvhsAabb { min: p(i), max: p(i) }).collect();
            let clusters = self::clusters(&boxes, 10);
            assert!(clusters.par_iter().all(|keys| keys.len() <= 10 || scale < 1e-40), "{scale}");
        }
    }
}
