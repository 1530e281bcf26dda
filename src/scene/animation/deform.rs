//! Deforms meshes: blends morph targets, then applies linear blend skinning.

use std::ops::Range;

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};

use crate::animation::tangent_frames::update_generated_frames;
use crate::{DeformedMesh, GeneratedFrames, Mesh, MorphTarget, Skin};
use blinn_core::geometry::cofactor;

/// The deformation of a mesh at one time.
pub(super) struct MeshDeformer<'a> {
    mesh: &'a Mesh,
    /// Weights of the morph targets.
    pub weights: &'a [f32],
    /// Skinning matrices of the joints, relative to `origin`. `None` for a mesh without skin.
    pub joints: Option<Vec<DAffine3>>,
    /// Origin of deformed positions in world space; zero for a mesh without skin, which its node places.
    pub origin: DVec3,
}

impl<'a> MeshDeformer<'a> {
    /// Prepares a deformation. Returns `None` if nothing deforms the mesh.
    pub fn new(
        mesh: &'a Mesh,
        weights: &'a [f32],
        skin: Option<&Skin>,
        node_to_world: &[DAffine3],
    ) -> Option<MeshDeformer<'a>> {
        let morphed = mesh.morph_targets.iter().zip(weights).any(|(_, &w)| w != 0.0);
        let skinning_matrix = |(&joint, inverse): (&u32, &DAffine3)| node_to_world[joint as usize] * *inverse;
        let joints =
            skin.map(|skin| skin.joints.iter().zip(&skin.inverse_bind).map(skinning_matrix).collect());
        (morphed || joints.is_some()).then(|| {
            let mut deformer = MeshDeformer { mesh, weights, joints, origin: DVec3::ZERO };
            deformer.move_origin_to_first_vertex();
            deformer
        })
    }

    /// Moves the origin to where the joints place the first vertex. There f32 keeps its precision, and weights
    /// that do not sum exactly to 1 do little harm, however far the mesh is from the world's origin.
    fn move_origin_to_first_vertex(&mut self) {
        let Some((joints, first)) = self.joints.as_ref().zip(self.mesh.positions.first()) else {
            return;
        };
        let origin = self.blended_matrix(0, joints).transform_point3(first.as_dvec3());
        if origin.is_finite() {
            self.origin = origin;
            self.joints.iter_mut().flatten().for_each(|joint| joint.translation -= origin);
        }
    }

    /// Deforms the whole mesh.
    pub fn deform(&self) -> DeformedMesh {
        let mut shape = self.blend_morph_targets();
        if let Some(joints) = &self.joints {
            self.apply_skin(&mut shape, joints);
            // Skinning would smooth generated flat normals.
            if self.mesh.generated_frames == GeneratedFrames::NormalsAndTangents {
                update_generated_frames(self.mesh, &mut shape);
            }
        }
        shape
    }

    /// Deforms only the positions of some vertices: bit-identical to [`MeshDeformer::deform`].
    pub fn deform_positions(&self, vertices: Range<usize>, into: &mut Vec<Vec3>) {
        into.clear();
        into.extend_from_slice(&self.mesh.positions[vertices.clone()]);
        for (target, &w) in self.mesh.morph_targets.iter().zip(self.weights).filter(|&(_, &w)| w != 0.0) {
            let displacements = target.positions.get(vertices.start..).unwrap_or_default();
            for (p, d) in into.iter_mut().zip(displacements) {
                *p += *d * w;
            }
        }
        if let Some(joints) = &self.joints {
            for (p, v) in into.iter_mut().zip(vertices) {
                *p = self.blended_matrix(v, joints).transform_point3(p.as_dvec3()).as_vec3();
            }
        }
    }

    /// Returns the skinning matrix of a vertex.
    fn blended_matrix(&self, vertex: usize, joints: &[DAffine3]) -> DAffine3 {
        let mut matrix = DAffine3::ZERO;
        self.influences(vertex, joints).for_each(|(j, w)| add_weighted(&mut matrix, &joints[j], w));
        matrix
    }

    /// Returns the joints that influence a vertex, with their weights.
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

    /// Adds the weighted morph targets to the mesh.
    fn blend_morph_targets(&self) -> DeformedMesh {
        let MeshDeformer { mesh, weights, .. } = *self;
        let mut shape = mesh.rest_shape();
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
            displace_uvs(&mut shape.uvs, mesh, target, w);
            displace_colors(&mut shape.colors, mesh, target, w);
        }
        // As the specification requires: after all targets.
        shape.colors.iter_mut().for_each(|c| *c = c.clamp(Vec4::ZERO, Vec4::ONE));
        for n in &mut shape.normals {
            *n = n.normalize_or_zero();
        }
        for t in &mut shape.tangents {
            *t = t.truncate().normalize_or_zero().extend(t.w);
        }
        if weights.iter().any(|&w| w != 0.0) {
            update_generated_frames(mesh, &mut shape);
        }
        shape
    }

    /// Applies linear blend skinning. The joints alone place the vertices.
    fn apply_skin(&self, shape: &mut DeformedMesh, joints: &[DAffine3]) {
        let normal_matrices: Vec<DMat3> = joints.iter().map(|joint| normal_matrix(joint.matrix3)).collect();
        for v in 0..shape.positions.len() {
            let mut matrix = DAffine3::ZERO;
            let mut for_normals = DMat3::ZERO;
            for (j, w) in self.influences(v, joints) {
                add_weighted(&mut matrix, &joints[j], w);
                for_normals += normal_matrices[j] * w;
            }
            shape.positions[v] = matrix.transform_point3(shape.positions[v].as_dvec3()).as_vec3();
            if let Some(normal) = shape.normals.get_mut(v) {
                *normal = (for_normals * normal.as_dvec3()).normalize_or_zero().as_vec3();
            }
            if let Some(tangent) = shape.tangents.get_mut(v) {
                let t = matrix.transform_vector3(tangent.truncate().as_dvec3());
                // The bitangent is mirrored with the surface: its sign changes with the cross product.
                let side = if matrix.matrix3.determinant() < 0.0 { -tangent.w } else { tangent.w };
                *tangent = t.normalize_or_zero().as_vec3().extend(side);
            }
        }
    }
}

/// Adds a morph target's displacements of texture coordinates, if it has some, to those of the mesh.
fn displace_uvs(sets: &mut Vec<Vec<Vec2>>, mesh: &Mesh, target: &MorphTarget, w: f32) {
    if sets.is_empty() && !target.uvs.is_empty() {
        sets.clone_from(&mesh.uvs);
    }
    for (uvs, displacements) in sets.iter_mut().zip(&target.uvs) {
        for (uv, d) in uvs.iter_mut().zip(displacements) {
            *uv += *d * w;
        }
    }
}

/// Adds a morph target's displacements of colours, if it has some, to those of the mesh.
fn displace_colors(colors: &mut Vec<Vec4>, mesh: &Mesh, target: &MorphTarget, w: f32) {
    if colors.is_empty() && !target.colors.is_empty() {
        colors.clone_from(&mesh.colors);
    }
    for (color, d) in colors.iter_mut().zip(&target.colors) {
        *color += *d * w;
    }
}

/// Adds a joint's matrix times its weight.
fn add_weighted(sum: &mut DAffine3, joint: &DAffine3, w: f64) {
    sum.matrix3 += joint.matrix3 * w;
    sum.translation += joint.translation * w;
}

/// Returns the matrix by which a joint transforms normals: the inverse transpose of `m`, scaled to the
/// magnitude of `m`, so that normals blend like vectors. It equals `m` for rotations with a uniform scale, and
/// stays finite for singular matrices.
fn normal_matrix(m: DMat3) -> DMat3 {
    let cofactor = cofactor(m);
    let axes = [cofactor.x_axis, cofactor.y_axis, cofactor.z_axis];
    let area = (axes.map(DVec3::length_squared).iter().sum::<f64>() / 3.0).sqrt();
    let side = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    if area > 0.0 { cofactor * (side / area.sqrt()) } else { DMat3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Joints then have the same weights for normals as for positions, as in three.js.
    #[test]
    fn rotations_and_uniform_scales_transform_normals_like_vectors() {
        for scale in [1.0, 1e-3, -2.0] {
            let m = DMat3::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 1.1) * scale;
            assert!(normal_matrix(m).abs_diff_eq(m, 1e-14));
        }
    }

    #[test]
    fn normals_stay_perpendicular_under_non_uniform_scale() {
        let m = DMat3::from_diagonal(DVec3::new(4.0, 1.0, 1.0));
        let normal = normal_matrix(m) * DVec3::new(1.0, 1.0, 0.0);
        assert!(normal.dot(m * DVec3::new(1.0, -1.0, 0.0)).abs() < 1e-12);
        let flat = normal_matrix(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0)));
        assert!(flat.is_finite() && (flat * DVec3::Y).y > 0.0);
        assert_eq!(normal_matrix(DMat3::from_diagonal(DVec3::X)), DMat3::ZERO);
    }

    #[test]
    fn displacements_of_colours_and_coordinates_are_added_and_colours_clamped_after_all() {
        let up = MorphTarget {
            uvs: vec![vec![], vec![Vec2::new(0.5, -1.0)]],
            colors: vec![Vec4::new(1.0, 0.5, -1.0, 0.0)],
            ..MorphTarget::default()
        };
        let down = MorphTarget { colors: vec![Vec4::new(-1.0, 0.0, 0.0, -0.5)], ..MorphTarget::default() };
        let mesh = Mesh {
            positions: vec![Vec3::ZERO],
            uvs: vec![vec![Vec2::ONE], vec![Vec2::ZERO]],
            colors: vec![Vec4::new(0.75, 0.25, 0.5, 1.0)],
            morph_targets: vec![up, down],
            ..Mesh::default()
        };
        let shape = |weights| MeshDeformer::new(&mesh, weights, None, &[]).unwrap().deform();
        let both = shape(&[1.0, 0.5]);
        // Red is 0.75 + 1 - 0.5, and would be 0.5 if it were clamped in between.
        assert_eq!(both.colors, [Vec4::new(1.0, 0.75, 0.0, 0.75)]);
        assert_eq!(both.uvs, [[Vec2::ONE], [Vec2::new(0.5, -1.0)]]);
        assert_eq!(shape(&[1.0, 1.0]).colors[0].x, 0.75);
        // Attributes that no target displaces are not copied.
        assert!(shape(&[0.0, 1.0]).uvs.is_empty());
    }

    /// Normal mapping needs unit vectors, whatever a target adds.
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
        let shape = MeshDeformer::new(&mesh, &[1.0], None, &[]).unwrap().deform();
        assert!(shape.normals[0].is_normalized());
        assert!(shape.tangents[0].truncate().is_normalized() && shape.tangents[0].w == -1.0);
    }
}
