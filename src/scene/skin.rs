//! Skins: the joints of skeletal animation.

use glam::DAffine3;

/// The joints of a skinned mesh, with their inverse bind matrices.
#[derive(Clone, Debug, Default)]
pub struct Skin {
    /// Name in the file.
    pub name: String,
    /// Node ids of the joints.
    pub joints: Vec<u32>,
    /// Inverse bind matrices, one for each joint: mesh space to joint space, in the bind pose.
    pub inverse_bind: Vec<DAffine3>,
}
