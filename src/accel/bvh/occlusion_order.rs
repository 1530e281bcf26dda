//! Child order for shadow rays: hit probability and expected cost of each subtree.
//!
//! The first hit of an any-hit ray is the whole answer, wherever it is. So the children of a node are visited in
//! descending order of hit probability per cost, not front to back: a wall before the furniture. (Ize and
//! Hansen, RTSAH Traversal Order for Occlusion Rays, 2011, weigh the two children of binary nodes.)

use crate::bvh::aabb::Aabb;
use blinn_scene::SurfaceClass;

/// Expected behaviour of random lines through a subtree's bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OcclusionCost {
    /// Probability that a line hits an occluder in the subtree.
    hit_probability: f64,
    /// Expected number of nodes and blocks that a line visits until it hits one, the subtree's root included.
    expected_cost: f64,
}

impl Default for OcclusionCost {
    /// The cost of an empty subtree.
    fn default() -> Self {
        OcclusionCost { hit_probability: 0.0, expected_cost: 1.0 }
    }
}

impl OcclusionCost {
    /// The cost of a leaf of `blocks` blocks, in which occluders have the given area (one side).
    pub fn of_leaf(bounds: Aabb, area: f64, blocks: u32) -> OcclusionCost {
        // A line through a convex body hits a flat surface in it with the ratio of both sides' area to the
        // body's surface.
        let hit_probability = (area / bounds.half_area().max(f64::MIN_POSITIVE)).min(1.0);
        OcclusionCost { hit_probability, expected_cost: f64::from(blocks) }
    }

    /// The cost of a node with these children, in the order of visiting.
    pub fn of_node(bounds: Aabb, children: impl Iterator<Item = (Aabb, OcclusionCost)>) -> OcclusionCost {
        let half_area = bounds.half_area().max(f64::MIN_POSITIVE);
        let mut expected_cost = 1.0;
        let mut miss_probability = 1.0;
        for (child_bounds, child) in children {
            let enters = (child_bounds.half_area() / half_area).min(1.0);
            expected_cost += enters * child.expected_cost * miss_probability;
            miss_probability *= 1.0 - enters * child.hit_probability;
        }
        OcclusionCost { hit_probability: 1.0 - miss_probability, expected_cost }
    }

    /// Children of higher priority are visited first.
    pub fn priority(self) -> f64 {
        self.hit_probability / self.expected_cost
    }
}

/// The share of a surface's area that counts as an occluder: alpha masks are taken to leave half of it.
pub(crate) fn occluding_fraction(class: SurfaceClass) -> f64 {
    match class {
        SurfaceClass::Opaque => 1.0,
        SurfaceClass::Cutout => 0.5,
        SurfaceClass::Translucent => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    const CUBE: Aabb = Aabb { min: Vec3::ZERO, max: Vec3::ONE };

    #[test]
    fn a_wall_through_a_cube_occludes_a_third_of_the_lines_through_it() {
        // A square across the middle of a cube has two sides against the cube's six.
        let third = OcclusionCost { hit_probability: 1.0 / 3.0, expected_cost: 2.0 };
        assert_eq!(OcclusionCost::of_leaf(CUBE, 1.0, 2), third);
        // More area than lines can miss.
        assert_eq!(OcclusionCost::of_leaf(CUBE, 7.0, 1).hit_probability, 1.0);
        // No area occludes nothing.
        let line = Aabb { min: Vec3::ZERO, max: Vec3::X };
        assert_eq!(OcclusionCost::of_leaf(line, 0.0, 1).hit_probability, 0.0);
    }

    #[test]
    fn lines_that_are_occluded_do_not_visit_later_children() {
        let half = OcclusionCost { hit_probability: 0.5, expected_cost: 3.0 };
        let two = OcclusionCost::of_node(CUBE, [(CUBE, half), (CUBE, half)].into_iter());
        assert_eq!(two, OcclusionCost { hit_probability: 0.75, expected_cost: 1.0 + 3.0 + 0.5 * 3.0 });
        // Half the area is entered half as often.
        let side = Aabb { min: Vec3::ZERO, max: Vec3::new(1.0, 1.0, 0.25) };
        let one = OcclusionCost::of_node(CUBE, std::iter::once((side, half)));
        assert_eq!(one, OcclusionCost { hit_probability: 0.25, expected_cost: 2.5 });
        assert!(half.priority() > two.priority() && one.priority() > OcclusionCost::default().priority());
    }

    #[test]
    fn the_largest_and_the_flattest_boxes_have_finite_priorities() {
        let largest = Aabb { min: Vec3::MIN, max: Vec3::MAX };
        let point = Aabb { min: Vec3::MAX, max: Vec3::MAX };
        for (bounds, area) in [(largest, 1e76), (point, 0.0), (CUBE, f64::MIN_POSITIVE)] {
            let leaf = OcclusionCost::of_leaf(bounds, area, 1);
            let node = OcclusionCost::of_node(bounds, std::iter::once((bounds, leaf)));
            assert!(leaf.priority().is_finite() && node.priority().is_finite(), "{node:?}");
        }
    }
}
