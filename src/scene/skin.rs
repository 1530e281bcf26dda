//! Skins: the joints that bend a mesh.

use glam::DAffine3;

/// Joints with the transforms that take the mesh into each joint's frame at rest.
#[derive(Clone, Debug, Default)]
pub struct Skin {
    /// Its name in the file.
    pub name: String,
    /// Node ids of the joints.
    pub joints: Vec<u32>,
    /// Inverse bind matrices, one for each joint.
    pub inverse_bind: Vec<DAffine3>,
}
