//! The scene graph, flattened: every node once for each place it is drawn.

use glam::{DAffine3, DMat4, DQuat, DVec3, Quat, Vec3};

/// A node's own transform, relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LocalTransform {
    /// Scale, then rotate, then translate: what animations act on.
    Trs {
        /// Translation in metres.
        translation: DVec3,
        /// Rotation, unit length.
        rotation: DQuat,
        /// Scale along each axis.
        scale: DVec3,
    },
    /// A matrix, taken as affine.
    Matrix(DAffine3),
}

impl Default for LocalTransform {
    fn default() -> Self {
        LocalTransform::IDENTITY
    }
}

impl LocalTransform {
    /// No transform.
    pub const IDENTITY: LocalTransform =
        LocalTransform::Trs { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE };

    /// A column-major 4×4 matrix as files store it; its last row is taken as (0, 0, 0, 1).
    pub fn from_cols(m: &[f64; 16]) -> LocalTransform {
        let m = DMat4::from_cols_array(m);
        LocalTransform::Matrix(DAffine3::from_cols(
            m.x_axis.truncate(),
            m.y_axis.truncate(),
            m.z_axis.truncate(),
            m.w_axis.truncate(),
        ))
    }

    /// As an affine transform.
    pub fn affine(&self) -> DAffine3 {
        match *self {
            LocalTransform::Trs { translation, rotation, scale } => {
                DAffine3::from_scale_rotation_translation(scale, rotation, translation)
            }
            LocalTransform::Matrix(m) => m,
        }
    }
}

/// A rotation of unit length from x, y, z, w; none where the numbers make none.
pub(crate) fn rotation(xyzw: [f32; 4]) -> DQuat {
    let q = Quat::from_array(xyzw).as_dquat();
    if q.is_finite() && q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
}

/// Where a copy of a mesh is below its node, in the file's own numbers: there may be millions.
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
    /// Scale, then rotate, then translate.
    pub fn affine(&self) -> DAffine3 {
        DAffine3::from_scale_rotation_translation(
            self.scale.as_dvec3(),
            rotation(self.rotation),
            self.translation.as_dvec3(),
        )
    }
}

/// A node of the scene graph. Files may reach a node by several paths: then it stands here once
/// for each, so that this is a forest.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// Its name in the file.
    pub name: String,
    /// Its parent, which stands before it in [`super::Scene::nodes`].
    pub parent: Option<u32>,
    /// Its transform relative to the parent, at rest.
    pub local: LocalTransform,
    /// Weights of the morph targets of its meshes, at rest; empty means the meshes' own.
    pub weights: Vec<f32>,
    /// False hides it and everything below it.
    pub visible: bool,
}

/// A mesh drawn at a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instance {
    /// The node that places it.
    pub node: u32,
    /// What is drawn.
    pub mesh: u32,
    /// The object it belongs to, counted from 1 (AOV `object-id`).
    pub object: u32,
    /// A further transform below the node's (EXT_mesh_gpu_instancing).
    pub trs: Option<PackedTrs>,
    /// The skin that bends it; the node's transform does not count then.
    pub skin: Option<u32>,
    /// Linear RGB that multiplies its vertex colours.
    pub color: Option<Vec3>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// There may be millions.
    #[test]
    fn instances_are_small() {
        assert!(size_of::<Instance>() <= 80);
    }
}
