use glam::Vec3A;

use super::*;

/// A row of unit cubes with a gap between neighbours; they overlap where it is negative.
fn row(count: u32, gap: f32) -> Vec<ObvhsAabb> {
    let cube = |i: u32| {
        let min = Vec3A::new(i as f32 * (1.0 + gap), 0.0, 0.0);
        ObvhsAabb { min, max: min + 1.0 }
    };
    (0..count).map(cube).collect()
}

/// Fills leaves with `counts` boxes one after the other, repacks them, and returns their boxes.
fn repacked(boxes: &[ObvhsAabb], counts: &[usize], entries: impl Fn(u32) -> u32) -> Vec<Vec<u32>> {
    let entry_box = |i: u32| EntryBox { bounds: boxes[i as usize], entries: entries(i) };
    let mut siblings = SiblingLeaves::default();
    let mut next = 0..boxes.len() as u32;
    for &count in counts {
        let mut leaf = Leaf::EMPTY;
        next.by_ref().take(count).for_each(|i| leaf.push(i, &entry_box(i)));
        siblings.push(leaf);
    }
    siblings.repack(LeafCapacity::BLOCKS, entry_box);
    for leaf in siblings.leaves() {
        let bounds = leaf.boxes().map(|i| boxes[i as usize]).reduce(|a, b| a.union(&b)).unwrap();
        assert_eq!(leaf.shape.bounds, bounds);
        assert_eq!(leaf.shape.entries, leaf.boxes().map(&entries).sum::<u32>());
    }
    let mut all: Vec<u32> = siblings.leaves().iter().flat_map(Leaf::boxes).collect();
    all.sort_unstable();
    assert!(all.into_iter().eq(0..boxes.len() as u32), "each box is in one leaf");
    siblings.leaves().iter().map(|leaf| leaf.boxes().collect()).collect()
}

#[test]
fn neighbouring_boxes_are_packed_into_fewer_leaves() {
    let counts = |leaves: Vec<Vec<u32>>| {
        let mut counts: Vec<usize> = leaves.iter().map(Vec::len).collect();
        counts.sort_unstable();
        counts
    };
    assert_eq!(counts(repacked(&row(12, 0.0), &[3, 2, 3, 4], |_| 1)), [4, 4, 4]);
    // Leaves of two blocks take boxes as well.
    assert_eq!(counts(repacked(&row(9, -0.5), &[3, 5, 1], |_| 1)), [3, 6]);
    assert_eq!(counts(repacked(&row(8, -0.5), &[5, 3], |_| 1)), [8]);
    // No room: nothing changes.
    assert_eq!(counts(repacked(&row(7, 0.0), &[3, 4], |_| 1)), [3, 4]);
    assert_eq!(counts(repacked(&row(8, 0.0), &[4, 4], |_| 1)), [4, 4]);
}

#[test]
fn boxes_go_where_they_cost_least() {
    let leaves = repacked(&row(8, 0.0), &[3, 2, 3], |_| 1);
    assert!(leaves.contains(&vec![0, 1, 2, 3]) && leaves.contains(&vec![5, 6, 7, 4]), "{leaves:?}");
}

#[test]
fn distant_leaves_are_not_merged() {
    let far = |b: &ObvhsAabb| ObvhsAabb { min: b.min + 100.0, max: b.max + 100.0 };
    let near = row(2, 0.0);
    let far = near.iter().map(far).collect();
    assert_eq!(repacked(&[near, far].concat(), &[2, 2], |_| 1), [[0, 1], [2, 3]]);
}

#[test]
fn a_leaf_over_capacity_takes_nothing() {
    // Three boxes at one of nine entries, which fill two blocks and a quarter.
    let boxes = [row(1, 0.0), row(3, 0.0)].concat();
    let leaves = repacked(&boxes, &[1, 1, 1, 1], |i| if i == 0 { 9 } else { 1 });
    assert!(leaves.contains(&vec![0]), "{leaves:?}");
    assert_eq!(leaves.len(), 2);
    // NaN costs change nothing.
    let huge = |i: u32| ObvhsAabb { min: Vec3A::splat(-1e30), max: Vec3A::splat(1e30 + i as f32 * 1e25) };
    let boxes: Vec<ObvhsAabb> = (0..6).map(huge).collect();
    assert_eq!(repacked(&boxes, &[2, 2, 2], |_| 1).len(), 3);
}
