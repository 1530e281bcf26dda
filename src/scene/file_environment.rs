//! The environment of a file, which animations can turn and dim.

use glam::{DMat3, DQuat};

use crate::Environment;
use blinn_core::geometry::Rgb;

/// An environment as a file gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct FileEnvironment {
    /// The light in the environment's own frame, at an intensity of 1.
    pub map: Environment,
    /// Factor of its radiance.
    pub intensity: f32,
    /// From its own frame to the file's coordinates.
    pub rotation: DQuat,
    /// From the file's coordinates to the world.
    pub axes: DMat3,
}

/// A property of an environment that animations can drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EnvironmentProperty {
    /// Factor of its radiance.
    Intensity,
    /// Rotation as a quaternion (4 components: x, y, z, w).
    Rotation,
}

impl EnvironmentProperty {
    /// Returns the number of components.
    pub fn width(self) -> usize {
        match self {
            EnvironmentProperty::Intensity => 1,
            EnvironmentProperty::Rotation => 4,
        }
    }
}

impl FileEnvironment {
    /// Makes an environment of the same radiance in all directions.
    pub fn uniform(radiance: Rgb) -> FileEnvironment {
        let map = Environment::uniform(radiance);
        FileEnvironment { map, intensity: 1.0, rotation: DQuat::IDENTITY, axes: DMat3::IDENTITY }
    }

    /// Returns the environment in the world.
    pub fn in_world(&self) -> Environment {
        let rotation = self.axes * DMat3::from_quat(self.rotation);
        self.map.clone().scaled(Rgb::splat(self.intensity)).rotated(rotation)
    }
}
