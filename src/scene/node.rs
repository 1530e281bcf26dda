//! Nodes of the scene graph and the instances drawn at them.

use glam::{DAffine3, DMat4, DQuat, DVec3, Quat, Vec3};

/// The transform of a node relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LocalTransform {
    /// Scale, then rotation, then translation. Animations act on these.
    Trs {
        /// Translation in metres.
        translation: DVec3,
        /// Rotation of unit length.
        rotation: DQuat,
        /// Scale along each axis.
        scale: DVec3,
    },
    /// An affine matrix.
    Matrix(DAffine3),
}

impl Default for LocalTransform {
    fn default() -> Self {
        LocalTransform::IDENTITY
    }
}

impl LocalTransform {
    /// The identity.
    pub const IDENTITY: LocalTransform =
        LocalTransform::Trs { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE };

    /// Reads a column-major 4×4 matrix, as files store it. Its last row is taken as (0, 0, 0, 1).
    pub fn from_cols(m: &[f64; 16]) -> LocalTransform {
        let m = DMat4::from_cols_array(m);
        LocalTransform::Matrix(DAffine3::from_cols(
            m.x_axis.truncate(),
            m.y_axis.truncate(),
            m.z_axis.truncate(),
            m.w_axis.truncate(),
        ))
    }

    /// Returns the affine transform.
    pub fn affine(&self) -> DAffine3 {
        match *self {
            LocalTransform::Trs { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(scale, rotation, translation)
            }
            LocalTransform::Matrix(m) => m,
        }
    }
}

/// Normalises a quaternion x, y, z, w. Returns the identity if that is impossible.
pub fn unit_quaternion(xyzw: [f32; 4]) -> DQuat {
    let q = Quat::from_array(xyzw).as_dquat();
    if q.is_finite() && q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
}

/// Translation, rotation and scale in f32, as files store them: there may be millions of instances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PackedTrs {
    /// Translation in metres.
    pub translation: Vec3,
    /// Rotation as x, y, z, w, of any length.
    pub rotation: [f32; 4],
    /// Scale along each axis.
    pub scale: Vec3,
}

impl PackedTrs {
    /// Returns the affine transform: scale, then rotation, then translation.
    pub fn affine(&self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(
            self.scale.as_dvec3(),
            unit_quaternion(self.rotation),
            self.translation.as_dvec3(),
        )
    }
}

/// A node of the scene graph. Nodes form a forest: a node that a file reaches by several paths is
/// repeated once for each.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// Name in the file.
    pub name: String,
    /// Parent, which comes before it in [`super::Scene::nodes`].
    pub parent: Option<u32>,
    /// Transform relative to the parent, in the rest pose.
    pub local: LocalTransform,
    /// Morph target weights of its meshes in the rest pose. Empty means those of the meshes.
    pub weights: Vec<f32>,
    /// False hides the node and everything below it.
    pub visible: bool,
}

/// A mesh drawn at a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instance {
    /// Node that places the mesh.
    pub node: u32,
    /// Mesh.
    pub mesh: u32,
    /// Object, counted from 1 (AOV `object-id`).
    pub object: u32,
    /// A further transform below the node's (EXT_mesh_gpu_instancing).
    pub trs: Option<PackedTrs>,
    /// Skin. The joints place a skinned mesh; its node's transform has no effect.
    pub skin: Option<u32>,
    /// Linear RGB that multiplies the vertex colours.
    pub color: Option<Vec3>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene may have millions of instances.
    #[test]
    fn instances_are_small() {
        assert!(size_of::<Instance>() <= 80);
    }
}
