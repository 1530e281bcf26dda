//! Which boxes lie together.
//!
//! Boxes are put along Morton's curve by their middles, and the curve is cut where its cells end, until
//! at most so many are in each region. So a region is a piece of space that no other one shares (but for what
//! sticks out of it), and a processor's cache holds all that is in it.

use std::ops::Range;

use glam::{UVec3, Vec3};
use obvhs::Boundable;
use obvhs::ploc::morton::morton_encode_u64;
use rayon::prelude::*;
use rdst::RadixSort;

/// Bits of a cell's place, for each axis.
const BITS: u32 = 11;
/// Bits of a box's index, which is less than 2^30 (`clean.rs`).
const INDEX: u32 = 30;

/// A box by its index, and its cell.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct MortonKey(u64);

impl MortonKey {
    pub fn index(self) -> usize {
        (self.0 & ((1 << INDEX) - 1)) as usize
    }

    /// Boxes in different ones have different middles, those in the same one may.
    pub fn cell(self) -> u64 {
        self.0 >> INDEX
    }
}

impl rdst::RadixKey for MortonKey {
    const LEVELS: usize = 8;

    fn get_level(&self, level: usize) -> u8 {
        (self.0 >> (8 * level)) as u8
    }
}

/// The boxes of all regions, one region after the other. They depend on the boxes alone.
pub(crate) struct MortonClusters {
    keys: Vec<MortonKey>,
    regions: Vec<Range<usize>>,
}

impl MortonClusters {
    /// MortonClusters of at most `most` boxes; of more where all have the same middle.
    pub fn new<T: Boundable + Sync>(boxes: &[T], most: usize) -> MortonClusters {
        let mut keys: Vec<MortonKey> = (0..boxes.len() as u64).into_par_iter().map(MortonKey).collect();
        let mut regions = Vec::new();
        // What is not cut yet, and whether its cells are known; what comes first last.
        let mut todo = vec![(0..keys.len(), false)];
        while let Some((range, ordered)) = todo.pop() {
            let some = &mut keys[range.clone()];
            if !ordered {
                order(boxes, some);
            }
            let (Some(first), Some(last)) = (some.first(), some.last()) else { break };
            let differ = first.cell() ^ last.cell();
            if some.len() <= most || !ordered && differ == 0 {
                regions.push(range);
            } else if differ == 0 {
                // Too many in one cell: it has cells of its own.
                todo.push((range, false));
            } else {
                let bit = differ.ilog2();
                let middle = range.start + some.partition_point(|key| key.cell() >> bit & 1 == 0);
                todo.extend([(middle..range.end, true), (range.start..middle, true)]);
            }
        }
        MortonClusters { keys, regions }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.regions.len()
    }

    /// The boxes of each, by cell.
    pub fn par_iter(&self) -> impl IndexedParallelIterator<Item = &[MortonKey]> {
        self.regions.par_iter().map(|region| &self.keys[region.clone()])
    }
}

/// Puts boxes along the curve through all that they take up. All are in one cell only where they have the
/// same middle.
fn order<T: Boundable + Sync>(boxes: &[T], keys: &mut [MortonKey]) {
    let middle = |key: &MortonKey| {
        let aabb = boxes[key.index()].aabb();
        Vec3::from(0.5 * (aabb.min + aabb.max))
    };
    let middles = keys.par_iter().with_min_len(1 << 12).map(middle);
    let (lo, hi) =
        middles.map(|p| (p, p)).reduce(|| (Vec3::MAX, Vec3::MIN), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    // Cells are cubes.
    let extent = (hi - lo).max_element();
    let last = UVec3::splat((1 << BITS) - 1);
    keys.par_iter_mut().with_min_len(1 << 12).for_each(|key| {
        let along = if extent > 0.0 { (middle(key) - lo) / extent } else { Vec3::ZERO };
        let cell = (along * (1u32 << BITS) as f32).as_uvec3().min(last);
        *key = MortonKey(morton_encode_u64(cell.x, cell.y, cell.z) << INDEX | key.index() as u64);
    });
    keys.radix_sort_unstable();
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;
    use obvhs::aabb::Aabb as ObvhsAabb;

    use super::*;

    fn at(places: impl Iterator<Item = [f32; 3]>) -> Vec<ObvhsAabb> {
        let one =
            |place: [f32; 3]| ObvhsAabb { min: Vec3A::from(place) - 0.5, max: Vec3A::from(place) + 0.5 };
        places.map(one).collect()
    }

    fn indices(of: &MortonClusters) -> Vec<Vec<usize>> {
        of.par_iter().map(|keys| keys.iter().map(|key| key.index()).collect()).collect()
    }

    #[test]
    fn every_box_is_in_one_region_and_none_has_too_many() {
        // A crowd of a millionth of the size of all, whose boxes begin in one cell.
        let near = (0..3000u32).map(|i| [i % 20, i / 20 % 20, i / 400].map(|x| x as f32));
        let far = (0..50u32).map(|i| [i as f32 * 2e6, 0.0, -1e8]);
        let boxes = at(near.chain(far));
        for most in [1, 7, 100, 5000] {
            let regions = indices(&MortonClusters::new(&boxes, most));
            assert!(regions.iter().all(|region| (1..=most).contains(&region.len())));
            let mut all = regions.concat();
            all.sort_unstable();
            assert!(all.into_iter().eq(0..boxes.len()));
        }
        assert!(indices(&MortonClusters::new(&boxes, 100)).len() < 150);
    }

    #[test]
    fn what_has_the_same_middle_stays_together() {
        let boxes = at((0..900u32).map(|i| [(i % 3) as f32, 0.0, 0.0]));
        let regions = indices(&MortonClusters::new(&boxes, 100));
        assert_eq!(regions.len(), 3);
        assert!(regions.iter().all(|region| region.iter().all(|i| i % 3 == region[0] % 3)));
        assert_eq!(MortonClusters::new(&boxes[..1], 100).len(), 1);
        assert_eq!(MortonClusters::new(&boxes[..0], 100).len(), 0);
    }

    #[test]
    fn the_largest_and_the_smallest_extents_have_cells() {
        for scale in [1e-44f32, 1e-30, 1e18] {
            let place = |i: u32| Vec3A::from([i as f32 * scale / 100.0, 0.0, 0.0]);
            let boxes: Vec<ObvhsAabb> =
                (0..100).map(|i| ObvhsAabb { min: place(i), max: place(i) }).collect();
            let regions = MortonClusters::new(&boxes, 10);
            assert!(regions.par_iter().all(|keys| keys.len() <= 10 || scale < 1e-40), "{scale}");
        }
    }
}
