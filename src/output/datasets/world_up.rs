//! The world of a dataset.

use glam::{DMat3, DVec3};

/// The up axis of a dataset's world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum WorldUp {
    /// (x, y, z): unchanged, as in glTF.
    Y,
    /// (x, −z, y): as in Blender, and as the tools expect.
    Z,
}

impl WorldUp {
    /// The rotation from blinn's world to the dataset's.
    pub fn rotation(self) -> DMat3 {
        match self {
            WorldUp::Y => DMat3::IDENTITY,
            WorldUp::Z => DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
        }
    }
}
