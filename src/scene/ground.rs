//! A ground plane for scenes without one: visible, or a shadow catcher.

use glam::DVec3;

use blinn_core::geometry::{Aabb, Rgb};

/// The appearance of a ground plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum GroundKind {
    /// A matte grey plane.
    Plane,
    /// Only the shadows that fall on it (a shadow catcher).
    ShadowCatcher,
}

/// A horizontal ground plane that fades out with distance, so that it has no visible edge. It is not
/// part of the scene: bounds, names, ids and AOVs ignore it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Appearance.
    pub kind: GroundKind,
    /// Centre in world coordinates. Its y is the height of the ground.
    pub centre: DVec3,
    /// Size of the scene: half the diagonal of its bounds, in metres.
    pub size: f64,
}

impl Ground {
    /// k_d and k_a of [`GroundKind::Plane`].
    pub const GREY: Rgb = Rgb::splat(0.5);
    /// Gap between the scene and the ground, in sizes: more than rounding moves a surface (see
    /// docs/decisions/soft-shadows-and-ambient-occlusion.md), and less than a pixel.
    const GAP: f64 = 1e-5;
    /// Distance from the centre where fading starts, in sizes.
    const FADE_START: f64 = 3.0;
    /// Distance from the centre where fading ends, in sizes.
    const FADE_END: f64 = 15.0;

    /// Returns the ground below `bounds` (world coordinates); below the origin if they are empty.
    pub fn under(bounds: &Aabb, kind: GroundKind) -> Ground {
        let half = 0.5 * bounds.extent().length();
        let size = if half > 0.0 { half } else { 1.0 };
        let centre = bounds.centre();
        let lowest = if bounds.is_empty() { 0.0 } else { bounds.min.y };
        Ground { kind, centre: DVec3::new(centre.x, lowest - Ground::GAP * size, centre.z), size }
    }

    /// Returns the opacity, 1…0, at a distance from the centre.
    pub fn opacity(&self, distance: f64) -> f32 {
        let s = (Ground::FADE_END - distance / self.size) / (Ground::FADE_END - Ground::FADE_START);
        let s = s.clamp(0.0, 1.0);
        (s * s * (3.0 - 2.0 * s)) as f32
    }
}
