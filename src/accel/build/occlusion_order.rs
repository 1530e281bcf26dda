//! How likely a box is to end a ray that asks for any hit, and what it costs to ask it.
//!
//! The first thing that stops such a ray is the whole answer, wherever it is. So of a node's children those
//! are asked first that stop most lines for the least work, and not the nearest: a wall before the furniture.
//! (Ize and Hansen, RTSAH Traversal Order for Occlusion Rays, 2011, weigh the two children of binary nodes.)

use crate::accel::bvh::bvh8::{Box3, half_surface};
use crate::scene::SurfaceClass;

/// What is known of the lines through a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Odds {
    /// The share of them that is stopped in it.
    stops: f64,
    /// Nodes and blocks that one looks into, its own included, until it is stopped.
    costs: f64,
}

/// Of boxes with nothing in them.
impl Default for Odds {
    fn default() -> Self {
        Odds { stops: 0.0, costs: 1.0 }
    }
}

impl Odds {
    /// Of a leaf of so many blocks, whose surfaces stop light as much as `area` does.
    pub fn of_leaf(bounds: Box3, area: f64, blocks: u32) -> Odds {
        // A line through a convex body meets a flat thing within in proportion to both its sides.
        let stops = (area / half_surface(bounds).max(f64::MIN_POSITIVE)).min(1.0);
        Odds { stops, costs: f64::from(blocks) }
    }

    /// Of what holds others, in the order in which they are asked.
    pub fn of_all(whole: Box3, children: impl Iterator<Item = (Box3, Odds)>) -> Odds {
        let whole = half_surface(whole).max(f64::MIN_POSITIVE);
        let (mut costs, mut left) = (1.0, 1.0);
        for (bounds, odds) in children {
            let share = (half_surface(bounds) / whole).min(1.0);
            costs += share * odds.costs * left;
            left *= 1.0 - share * odds.stops;
        }
        Odds { stops: 1.0 - left, costs }
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

    const CUBE: Box3 = (Vec3::ZERO, Vec3::ONE);

    #[test]
    fn a_wall_through_a_cube_stops_a_third_of_the_lines_through_it() {
        // Lines through a cube that meet a square across its middle: two sides of six.
        assert_eq!(Odds::of_leaf(CUBE, 1.0, 2), Odds { stops: 1.0 / 3.0, costs: 2.0 });
        // More surface than lines can miss.
        assert_eq!(Odds::of_leaf(CUBE, 7.0, 1).stops, 1.0);
        // What has no surface stops nothing.
        assert_eq!(Odds::of_leaf((Vec3::ZERO, Vec3::X), 0.0, 1).stops, 0.0);
    }

    #[test]
    fn what_is_stopped_before_is_not_asked_any_more() {
        let half = Odds { stops: 0.5, costs: 3.0 };
        let two = Odds::of_all(CUBE, [(CUBE, half), (CUBE, half)].into_iter());
        assert_eq!(two, Odds { stops: 0.75, costs: 1.0 + 3.0 + 0.5 * 3.0 });
        // Half as large, met half as often.
        let side = (Vec3::ZERO, Vec3::new(1.0, 1.0, 0.25));
        let one = Odds::of_all(CUBE, std::iter::once((side, half)));
        assert_eq!(one, Odds { stops: 0.25, costs: 2.5 });
        assert!(half.worth() > two.worth() && one.worth() > Odds::default().worth());
    }

    #[test]
    fn the_largest_and_the_flattest_boxes_have_numbers() {
        let most = Vec3::splat(f32::MAX);
        for (bounds, area) in [((-most, most), 1e76), ((most, most), 0.0), (CUBE, f64::MIN_POSITIVE)] {
            let leaf = Odds::of_leaf(bounds, area, 1);
            let odds = Odds::of_all(bounds, std::iter::once((bounds, leaf)));
            assert!(leaf.worth().is_finite() && odds.worth().is_finite(), "{odds:?}");
        }
    }
}
