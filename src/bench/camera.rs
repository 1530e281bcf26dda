//! The cameras that a scene is measured from.

use glam::DVec3;

use blinn_core::geometry::Aabb;
use blinn_scene::{Orbit, View};

/// The least extent of the box that cameras are placed in along an axis, as a fraction of the largest.
const MIN_EXTENT: f64 = 0.1;

/// A camera of a benchmark scene. It is placed relative to the scene's bounds, so that it does not depend on the
/// file's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct BenchCamera {
    /// Its name in the results.
    pub name: String,
    /// Its placement.
    pub placement: CameraPlacement,
}

/// The placement of a [`BenchCamera`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CameraPlacement {
    /// A position and a point to look at, as fractions of the scene's bounding box from its lowest corner.
    InBounds {
        /// The position.
        eye: [f64; 3],
        /// The point to look at.
        look_at: [f64; 3],
        /// Vertical field of view in radians.
        yfov: f64,
    },
    /// A direction from which the whole scene is framed.
    Orbit {
        /// Radians from the front (+Z) to the right (+X).
        azimuth: f64,
        /// Radians above the horizon.
        elevation: f64,
    },
}

impl BenchCamera {
    /// The view of a scene with these bounds in world coordinates.
    pub fn view(&self, bounds: Aabb) -> View {
        let extent = bounds.extent();
        // In a flat scene, positions differ along all axes as well.
        let extent = extent.max(DVec3::splat(MIN_EXTENT * extent.max_element()));
        let at = |fraction: [f64; 3]| bounds.min + extent * DVec3::from_array(fraction);
        match self.placement {
            CameraPlacement::InBounds { eye, look_at, yfov } => View {
                view_point: Some(at(eye)),
                look_at: Some(at(look_at)),
                yfov: Some(yfov),
                ..View::default()
            },
            CameraPlacement::Orbit { azimuth, elevation } => {
                View { orbit: Some(Orbit { azimuth, elevation, distance: None }), ..View::default() }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_follow_the_bounds_also_of_flat_scenes() {
        let placement =
            CameraPlacement::InBounds { eye: [0.5, 0.5, 2.0], look_at: [0.5, 0.5, 0.0], yfov: 1.0 };
        let camera = BenchCamera { name: "a".into(), placement };
        let bounds = |depth: f64| Aabb { min: DVec3::splat(-1.0), max: DVec3::new(3.0, 1.0, depth - 1.0) };
        let view = camera.view(bounds(4.0));
        assert_eq!(view.view_point, Some(DVec3::new(1.0, 0.0, 7.0)));
        assert_eq!(view.look_at, Some(DVec3::new(1.0, 0.0, -1.0)));
        let flat = camera.view(bounds(0.0)).view_point.unwrap();
        assert!((flat.z - (-1.0 + 2.0 * 0.4)).abs() < 1e-12, "{flat}");
    }
}
