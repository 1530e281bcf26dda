//! Lights for scenes that bring none, fixed to the camera.

use glam::DVec3;

use super::{Camera, PosedLight};
use crate::geometry::Rgb;

/// Lights with the ambient colour that goes with them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// The lights.
    pub lights: Vec<PosedLight>,
    /// I_a.
    pub ambient: Rgb,
}

/// A key light from the upper left, a fill from the right, a rim from behind: all suns, so that
/// the picture does not depend on the scene's size. A white Lambertian stays below 1.
pub fn three_point(camera: &Camera) -> Rig {
    let basis = camera.basis;
    let sun = |to_light: DVec3, e: f32| {
        let l = basis.u * to_light.x + basis.v * to_light.y + basis.w * to_light.z;
        PosedLight::sun(-l, Rgb::splat(e))
    };
    Rig {
        lights: vec![
            sun(DVec3::new(-0.55, 0.75, 0.85), 0.68),
            sun(DVec3::new(0.9, 0.15, 0.7), 0.2),
            sun(DVec3::new(0.45, 0.7, -0.9), 0.3),
        ],
        ambient: Rgb::splat(0.1),
    }
}

/// The lecture's "dim light at camera": a sun along the view.
pub fn headlight(camera: &Camera) -> Rig {
    Rig { lights: vec![PosedLight::sun(-camera.basis.w, Rgb::splat(0.8))], ambient: Rgb::splat(0.05) }
}
