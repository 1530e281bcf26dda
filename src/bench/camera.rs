//! The cameras that a scene is measured from.

use glam::DVec3;

use crate::geometry::Aabb;
use crate::scene::{Orbit, View};

/// A camera of a benchmark scene. It is placed relative to the scene's bounds, so that it does not depend on the
/// file's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct BenchCamera {
    /// Its name in the results.
    pub name: String,
    /// Where it is.
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
        let at = |fraction: [f64; 3]| bounds.min + bounds.extent() * DVec3::from_array(fraction);
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
