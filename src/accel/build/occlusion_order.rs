//! How likely a box is to end a ray that asks for any hit, and what it costs to ask it.
//!
//! The first thing that stops such a ray is the whole answer, wherever it is. So of a node's children those
//! are asked first that stop most lines for the least work, and not the nearest: a wall before the furniture.
//! (Ize and Hansen, RTSAH Traversal Order for Occlusion Rays, 2011, weigh the two children of binary nodes.)

use crate::accel::bvh::aabb::Aabb;
use crate::scene::SurfaceClass;

/// What is known of the lines through a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OcclusionCost {
    /// The share of them that is stopped in it.
    stops: f64,
    /// Nodes and blocks that one looks into, its own included, until it is stopped.
    costs: f64,
}

/// Of boxes with nothing in them.
impl Default for OcclusionCost {
    fn default() -> Self {
        OcclusionCost { stops: 0.0, costs: 1.0 }
    }
}

impl OcclusionCost {
    /// Of a leaf of so many blocks, whose surfaces stop light as much as `area` does.
    pub fn of_leaf(bounds: Aabb, area: f64, blocks: u32) -> OcclusionCost {
        // A line through a convex body meets a flat thing within in proportion to both its sides.
        let stops = (area / bounds.half_area().max(f64::MIN_POSITIVE)).min(1.0);
        OcclusionCost { stops, costs: f64::from(blocks) }
    }

    /// Of what holds others, in the order in which they are asked.
    pub fn of_all(whole: Aabb, children: impl Iterator<Item = (Aabb, OcclusionCost)>) -> OcclusionCost {
        let whole = whole.half_area().max(f64::MIN_POSITIVE);
        let (mut costs, mut left) = (1.0, 1.0);
        for (bounds, odds) in children {
            let share = (bounds.half_area() / whole).min(1.0);
            costs += share * odds.costs * left;
            left *= 1.0 - share * odds.stops;
        }
        OcclusionCost { stops: 1.0 - left, costs }
    }

    /// Whoever has more is asked first.
    pub fn worth(self) -> f64 {
        self.stops / self.costs
    }
}

/// How much of a surface's area counts as stopping light: holes are taken for half of it.
pub(crate) fn stopping(class: SurfaceClass) -> f64 {
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
    fn a_wall_through_a_cube_stops_a_third_of_the_lines_through_it() {
        // Lines through a cube that meet a square across its middle: two sides of six.
        assert_eq!(OcclusionCost::of_leaf(CUBE, 1.0, 2), OcclusionCost { stops: 1.0 / 3.0, costs: 2.0 });
        // More surface than lines can miss.
        assert_eq!(OcclusionCost::of_leaf(CUBE, 7.0, 1).stops, 1.0);
        // What has no surface stops nothing.
        assert_eq!(OcclusionCost::of_leaf(Aabb { min: Vec3::ZERO, max: Vec3::X }, 0.0, 1).stops, 0.0);
    }

    #[test]
    fn what_is_stopped_before_is_not_asked_any_more() {
        let half = OcclusionCost { stops: 0.5, costs: 3.0 };
        let two = OcclusionCost::of_all(CUBE, [(CUBE, half), (CUBE, half)].into_iter());
        assert_eq!(two, OcclusionCost { stops: 0.75, costs: 1.0 + 3.0 + 0.5 * 3.0 });
        // Half as large, met half as often.
        let side = Aabb { min: Vec3::ZERO, max: Vec3::new(1.0, 1.0, 0.25) };
        let one = OcclusionCost::of_all(CUBE, std::iter::once((side, half)));
        assert_eq!(one, OcclusionCost { stops: 0.25, costs: 2.5 });
        assert!(half.worth() > two.worth() && one.worth() > OcclusionCost::default().worth());
    }

    #[test]
    fn the_largest_and_the_flattest_boxes_have_numbers() {
        let most = Vec3::splat(f32::MAX);
        for (bounds, area) in [
            (Aabb { min: -most, max: most }, 1e76),
            (Aabb { min: most, max: most }, 0.0),
            (CUBE, f64::MIN_POSITIVE),
        ] {
            let leaf = OcclusionCost::of_leaf(bounds, area, 1);
            let odds = OcclusionCost::of_all(bounds, std::iter::once((bounds, leaf)));
            assert!(leaf.worth().is_finite() && odds.worth().is_finite(), "{odds:?}");
        }
    }
}
