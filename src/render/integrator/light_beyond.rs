//! The light from beyond the scene that meets matte surfaces: the environment's, or the ambient light.

use crate::integrator::frame::Frame;
use blinn_core::geometry::Rgb;
use blinn_scene::Environment;
use glam::Vec3;

/// The light that diffuse rays find which pass the scene, without the light sources of an environment.
pub(crate) struct LightBeyond {
    /// The environment, unless its light is the same from all directions.
    pub environment: Option<Environment>,
    uniform: Rgb,
}

impl LightBeyond {
    pub fn new(frame: &Frame) -> LightBeyond {
        LightBeyond { environment: frame.ambient_environment(), uniform: frame.ambient_radiance() }
    }

    /// Radiance from direction `d`, a mean over a solid angle in steradians.
    pub fn radiance(&self, d: Vec3, solid_angle: f32) -> Rgb {
        match &self.environment {
            Some(environment) => environment.radiance(d, solid_angle),
            None => self.uniform,
        }
    }

    /// Returns true if no light comes from beyond the scene.
    pub fn is_black(&self) -> bool {
        self.environment.is_none() && self.uniform == Rgb::ZERO
    }
}
