//! A ground for scenes that bring none.

use glam::DVec3;

use crate::geometry::{Aabb, Rgb};

/// What a ground shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GroundKind {
    /// Itself, grey and matt.
    Plane,
    /// Only the shadows that fall on it: it catches them and is not there otherwise.
    ShadowCatcher,
}

/// A level ground that ends in no line: far out it thins until it is gone. It is no part of the
/// scene: no bounds, names, ids or layers know of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// What it shows.
    pub kind: GroundKind,
    /// Its middle, in world coordinates; its height is the ground's.
    pub centre: DVec3,
    /// Size of what stands on it: half the diagonal of its bounds.
    pub size: f64,
}

impl Ground {
    /// k_d and k_a of [`GroundKind::Plane`].
    pub const GREY: Rgb = Rgb::splat(0.5);
    /// How far below what stands on it a ground lies, in sizes: more than rounding moves a surface
    /// (see docs/decisions/0041-intersect-the-ground-analytically.md), and less than a pixel.
    const GAP: f64 = 1e-5;
    /// Whole up to here, in sizes from its middle.
    const WHOLE: f64 = 3.0;
    /// Gone from here on.
    const GONE: f64 = 15.0;

    /// The ground below everything in `bounds`, in world coordinates; below the origin where there
    /// is nothing.
    pub fn under(bounds: &Aabb, kind: GroundKind) -> Ground {
        let half = 0.5 * bounds.extent().length();
        let size = if half > 0.0 { half } else { 1.0 };
        let centre = bounds.centre();
        let lowest = if bounds.is_empty() { 0.0 } else { bounds.min.y };
        Ground { kind, centre: DVec3::new(centre.x, lowest - Ground::GAP * size, centre.z), size }
    }

    /// How much of it is there at a distance from its middle: 1 … 0.
    pub fn opacity(&self, distance: f64) -> f32 {
        let s = (Ground::GONE - distance / self.size) / (Ground::GONE - Ground::WHOLE);
        let s = s.clamp(0.0, 1.0);
        (s * s * (3.0 - 2.0 * s)) as f32
    }
}
