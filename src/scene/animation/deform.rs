//! Meshes bent: morph targets are blended in, then joints take the vertices along.

use std::ops::Range;

use glam::{DAffine3, DMat3, DVec3, Vec3, Vec4};

use crate::geometry::cofactor;
use crate::scene::animation::tangent_frames::{GeneratedFrames, carry};
use crate::scene::{Mesh, Skin};

/// A mesh bent by a skin or by morph targets.
#[derive(Clone, Debug, Default)]
pub struct DeformedMesh {
    /// Replaces the mesh's positions.
    pub positions: Vec<Vec3>,
    /// Replaces its normals; empty where the mesh has none.
    pub normals: Vec<Vec3>,
    /// Replaces its tangents; empty where the mesh has none.
    pub tangents: Vec<Vec4>,
}

/// What bends a mesh at one moment.
pub(crate) struct MeshDeformer<'a> {
    mesh: &'a Mesh,
    /// Of its morph targets.
    pub weights: &'a [f32],
    /// Where each joint takes what is bound to it, from `origin` on; `None` for a mesh without skin.
    pub joints: Option<Vec<DAffine3>>,
    /// Where in the world bent positions begin: zero for a mesh without skin, which its node places.
    pub origin: DVec3,
}

impl<'a> MeshDeformer<'a> {
    /// `None` where nothing bends the mesh.
    pub fn new(
        mesh: &'a Mesh,
        weights: &'a [f32],
        skin: Option<&Skin>,
        node_to_world: &[DAffine3],
    ) -> Option<MeshDeformer<'a>> {
        let morphed = mesh.morph_targets.iter().zip(weights).any(|(_, &w)| w != 0.0);
        let placed = |(&joint, inverse): (&u32, &DAffine3)| node_to_world[joint as usize] * *inverse;
        let joints = skin.map(|skin| skin.joints.iter().zip(&skin.inverse_bind).map(placed).collect());
        (morphed || joints.is_some())
            .then(|| MeshDeformer { mesh, weights, joints, origin: DVec3::ZERO }.at_home())
    }

    /// Has positions begin where the joints take the first vertex. About it f32 has its precision, and weights may
    /// sum to a little more or less than one, however far from the world's origin that is.
    fn at_home(mut self) -> MeshDeformer<'a> {
        let Some((joints, first)) = self.joints.as_ref().zip(self.mesh.positions.first()) else {
            return self;
        };
        let at = self.together(0, joints).transform_point3(first.as_dvec3());
        if at.is_finite() {
            self.origin = at;
            self.joints.iter_mut().flatten().for_each(|joint| joint.translation -= at);
        }
        self
    }

    /// The whole mesh.
    pub fn whole(&self) -> DeformedMesh {
        let mut shape = self.blended();
        if let Some(joints) = &self.joints {
            self.take_along(&mut shape, joints);
            // What joints bend is no less flat for it.
            if self.mesh.generated_frames == GeneratedFrames::NormalsAndTangents {
                carry(self.mesh, &mut shape);
            }
        }
        shape
    }

    /// The positions of some of its vertices, for those who ask for no more: the bits of [`MeshDeformer::whole`].
    pub fn positions(&self, vertices: Range<usize>, into: &mut Vec<Vec3>) {
        into.clear();
        into.extend_from_slice(&self.mesh.positions[vertices.clone()]);
        for (target, &w) in self.mesh.morph_targets.iter().zip(self.weights).filter(|&(_, &w)| w != 0.0) {
            let moved = target.positions.get(vertices.start..).unwrap_or_default();
            for (p, d) in into.iter_mut().zip(moved) {
                *p += *d * w;
            }
        }
        if let Some(joints) = &self.joints {
            for (p, v) in into.iter_mut().zip(vertices) {
                *p = self.together(v, joints).transform_point3(p.as_dvec3()).as_vec3();
            }
        }
    }

    /// Where the joints that a vertex follows take it.
    fn together(&self, vertex: usize, joints: &[DAffine3]) -> DAffine3 {
        let mut placed = DAffine3::ZERO;
        self.influences(vertex, joints).for_each(|(j, w)| blend(&mut placed, &joints[j], w));
        placed
    }

    /// The joints that a vertex follows, with their weights.
    fn influences<'b>(
        &'b self,
        vertex: usize,
        joints: &'b [DAffine3],
    ) -> impl Iterator<Item = (usize, f64)> + 'b {
        let influences = &self.mesh.influences;
        let n = influences.per_vertex;
        (vertex * n..(vertex + 1) * n)
            .map(|i| (influences.joints[i] as usize, f64::from(influences.weights[i])))
            .filter(|&(j, w)| w != 0.0 && j < joints.len())
    }

    /// The mesh with its morph targets blended in.
    fn blended(&self) -> DeformedMesh {
        let MeshDeformer { mesh, weights, .. } = *self;
        let mut shape = DeformedMesh {
            positions: mesh.positions.clone(),
            normals: mesh.normals.clone(),
            tangents: mesh.tangents.clone(),
        };
        for (target, &w) in mesh.morph_targets.iter().zip(weights).filter(|&(_, &w)| w != 0.0) {
            for (p, d) in shape.positions.iter_mut().zip(&target.positions) {
                *p += *d * w;
            }
            for (n, d) in shape.normals.iter_mut().zip(&target.normals) {
                *n += *d * w;
            }
            for (t, d) in shape.tangents.iter_mut().zip(&target.tangents) {
                *t += (*d * w).extend(0.0);
            }
        }
        for n in &mut shape.normals {
            *n = n.normalize_or_zero();
        }
        for t in &mut shape.tangents {
            *t = t.truncate().normalize_or_zero().extend(t.w);
        }
        if weights.iter().any(|&w| w != 0.0) {
            carry(mesh, &mut shape);
        }
        shape
    }

    /// Linear blend skinning: the joints' transforms alone place the vertices.
    fn take_along(&self, shape: &mut DeformedMesh, joints: &[DAffine3]) {
        let for_normals: Vec<DMat3> = joints.iter().map(|joint| for_normals(joint.matrix3)).collect();
        for v in 0..shape.positions.len() {
            let mut placed = DAffine3::ZERO;
            let mut turned = DMat3::ZERO;
            for (j, w) in self.influences(v, joints) {
                blend(&mut placed, &joints[j], w);
                turned += for_normals[j] * w;
            }
            shape.positions[v] = placed.transform_point3(shape.positions[v].as_dvec3()).as_vec3();
            if let Some(normal) = shape.normals.get_mut(v) {
                *normal = (turned * normal.as_dvec3()).normalize_or_zero().as_vec3();
            }
            if let Some(tangent) = shape.tangents.get_mut(v) {
                let t = placed.transform_vector3(tangent.truncate().as_dvec3());
                *tangent = t.normalize_or_zero().as_vec3().extend(tangent.w);
            }
        }
    }
}

/// Adds a joint's share.
fn blend(placed: &mut DAffine3, joint: &DAffine3, w: f64) {
    placed.matrix3 += joint.matrix3 * w;
    placed.translation += joint.translation * w;
}

/// What a joint's `m` does to the normals it bends: its inverse transpose, as large as `m` is on the whole, so
/// that normals are blended as vectors are. What turns and scales evenly is its own; what flattens stays finite.
fn for_normals(m: DMat3) -> DMat3 {
    let cofactor = cofactor(m);
    let axes = [cofactor.x_axis, cofactor.y_axis, cofactor.z_axis];
    let area = (axes.map(DVec3::length_squared).iter().sum::<f64>() / 3.0).sqrt();
    let side = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    if area > 0.0 { cofactor * (side / area.sqrt()) } else { DMat3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::MorphTarget;

    /// A joint weighs as much in a normal as in the position, so a bend has the normals of three.js.
    #[test]
    fn a_joint_that_turns_and_scales_evenly_moves_normals_as_it_moves_vectors() {
        for scale in [1.0, 1e-3, -2.0] {
            let m = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1) * scale;
            assert!(for_normals(m).abs_diff_eq(m, 1e-14));
        }
    }

    #[test]
    fn normals_stay_perpendicular_to_what_a_joint_stretches() {
        let m = DMat3::from_diagonal(DVec3::new(4.0, 1.0, 1.0));
        let normal = for_normals(m) * DVec3::new(1.0, 1.0, 0.0);
        assert!(normal.dot(m * DVec3::new(1.0, -1.0, 0.0)).abs() < 1e-12);
        let flat = for_normals(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0)));
        assert!(flat.is_finite() && (flat * DVec3::Y).y > 0.0);
        assert_eq!(for_normals(DMat3::from_diagonal(DVec3::X)), DMat3::ZERO);
    }

    /// What normal maps build on keeps its length, whatever a target adds.
    #[test]
    fn morphed_normals_and_tangents_have_unit_length() {
        let target = MorphTarget {
            positions: vec![Vec3::X],
            normals: vec![Vec3::X],
            tangents: vec![Vec3::new(1.0, 0.0, -1.0)],
            ..MorphTarget::default()
        };
        let mesh = Mesh {
            positions: vec![Vec3::ZERO],
            normals: vec![Vec3::Z],
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, -1.0)],
            morph_targets: vec![target],
            ..Mesh::default()
        };
        let shape = MeshDeformer::new(&mesh, &[1.0], None, &[]).unwrap().whole();
        assert!(shape.normals[0].is_normalized());
        assert!(shape.tangents[0].truncate().is_normalized() && shape.tangents[0].w == -1.0);
    }
}
