//! Light rigs fixed to the camera, for scenes without lights.

use glam::{DMat3, DVec3};

use super::{Camera, Environment, PosedAreaLight, PosedLight, SkyIrradiance};
use blinn_core::geometry::{Basis, Rgb};

/// Lights with a matching ambient term.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// Lights.
    pub lights: Vec<PosedLight>,
    /// Area lights.
    pub area_lights: Vec<PosedAreaLight>,
    /// True if the glowing surfaces of the scene light others.
    pub glowing_surfaces: bool,
    /// I_a.
    pub ambient: Rgb,
    /// An I_a that depends on the normal, in place of `ambient`.
    pub sky: Option<SkyIrradiance>,
    /// The light from infinitely far away that specular lobes reflect; `None` reflects black.
    pub environment: Option<Environment>,
}

impl Rig {
    /// Returns true if no light, ambient term or environment lights the scene.
    pub fn is_dark(&self) -> bool {
        self.lights.is_empty()
            && self.area_lights.is_empty()
            && !self.glowing_surfaces
            && self.ambient == Rgb::ZERO
            && self.sky.is_none()
            && self.environment.is_none()
    }
}

/// Returns the three-point rig: a key light from the upper left, a fill light from the right and a rim
/// light from behind. All are suns, so the picture does not depend on the size of the scene. A white
/// Lambertian surface stays below 1. [`studio_before`] is what specular lobes reflect beside it.
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
        ..Rig::default()
    }
}

/// Returns [`Environment::studio`], fixed to the camera like the lights of the three-point rig.
pub fn studio_before(camera: &Camera) -> Environment {
    Environment::studio().rotated(orthonormal(&camera.basis))
}

/// Returns the axes of a basis, made orthogonal where a file's camera shears them.
fn orthonormal(basis: &Basis) -> DMat3 {
    let w = basis.w;
    let v = basis.v.reject_from_normalized(w).normalize();
    let u = v.cross(w);
    DMat3::from_cols(if u.dot(basis.u) < 0.0 { -u } else { u }, v, w)
}

/// Returns the lecture's “dim light at camera”: a sun along the view direction.
pub fn headlight(camera: &Camera) -> Rig {
    Rig {
        lights: vec![PosedLight::sun(-camera.basis.w, Rgb::splat(0.8))],
        ambient: Rgb::splat(0.05),
        ..Rig::default()
    }
}
