//! Tangent frames of deformed meshes: generated normals and tangents follow their triangles.

use glam::{DMat3, DVec3, Vec3};

use crate::{DeformedMesh, GeneratedFrames, Mesh};

/// Recomputes the generated normals and tangents of `mesh` for its deformed shape. Where the deformation mirrors, it has
/// changed the sign of the bitangents.
pub(super) fn update_generated_frames(mesh: &Mesh, shape: &mut DeformedMesh) {
    if mesh.generated_frames == GeneratedFrames::None {
        return;
    }
    let mut tangents = vec![DVec3::ZERO; mesh.tangents.len()];
    for corners in mesh.triangles.iter().map(|t| t.map(|v| v as usize)) {
        let rest = triangle_frame(corners.map(|v| mesh.positions[v]));
        let deformed = triangle_frame(corners.map(|v| shape.positions[v]));
        let Some((rest, deformed)) = rest.zip(deformed) else { continue };
        let motion = deformed * rest.inverse();
        for v in corners {
            if mesh.generated_frames == GeneratedFrames::NormalsAndTangents {
                let is_mirrored = shape.tangents.get(v).is_some_and(|t| t.w != mesh.tangents[v].w);
                let side = if is_mirrored { -1.0 } else { 1.0 };
                shape.normals[v] = (deformed.z_axis * side).as_vec3();
            }
            if let Some(tangent) = tangents.get_mut(v) {
                *tangent += (motion * mesh.tangents[v].truncate().as_dvec3()).normalize_or_zero();
            }
        }
    }
    for ((tangent, sum), normal) in shape.tangents.iter_mut().zip(tangents).zip(&shape.normals) {
        // Where all triangles are degenerate, the tangent stays.
        if let Some(unit) = sum.reject_from(normal.as_dvec3()).try_normalize() {
            *tangent = unit.as_vec3().extend(tangent.w);
        }
    }
}

/// Returns two edges of a triangle and its unit normal; `None` without area.
fn triangle_frame([a, b, c]: [Vec3; 3]) -> Option<DMat3> {
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    let normal = (b - a).cross(c - a).try_normalize()?;
    Some(DMat3::from_cols(b - a, c - a, normal))
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, Vec4};

    use super::*;
    use crate::animation::deform::MeshDeformer;
    use crate::{Influences, MorphTarget, Skin};

    /// A triangle in z = 0. A morph target of weight 1 moves its third corner to `to`.
    fn morphed(generated_frames: GeneratedFrames, to: Vec3) -> DeformedMesh {
        let target =
            MorphTarget { positions: vec![Vec3::ZERO, Vec3::ZERO, to - Vec3::Y], ..MorphTarget::default() };
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            normals: vec![Vec3::Z; 3],
            tangents: vec![Vec4::new(0.0, 1.0, 0.0, -1.0); 3],
            morph_targets: vec![target],
            generated_frames,
            ..Mesh::default()
        };
        MeshDeformer::new(&mesh, &[1.0], None, &[]).unwrap().deform()
    }

    #[test]
    fn generated_frames_follow_a_morphed_triangle() {
        let flap = morphed(GeneratedFrames::NormalsAndTangents, Vec3::NEG_Z * 3.0);
        assert_eq!(flap.normals, [Vec3::Y; 3]);
        assert_eq!(flap.tangents, [Vec4::new(0.0, 0.0, -1.0, -1.0); 3]);
        // Normals from the file are kept.
        let slanted = morphed(GeneratedFrames::Tangents, Vec3::new(1.0, 1.0, 5.0));
        assert_eq!(slanted.normals, [Vec3::Z; 3]);
        let along = slanted.tangents[0].truncate();
        assert!(along.abs_diff_eq(Vec3::new(0.5f32.sqrt(), 0.5f32.sqrt(), 0.0), 1e-6), "{along}");
        assert_eq!(morphed(GeneratedFrames::None, Vec3::NEG_Z).tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 3]);
    }

    /// Blending joints would give the corners different normals.
    #[test]
    fn a_flat_triangle_stays_flat_between_joints() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            normals: vec![Vec3::Z; 3],
            tangents: vec![Vec4::new(0.0, 1.0, 0.0, -1.0); 3],
            influences: Influences { per_vertex: 1, joints: vec![0, 0, 1], weights: vec![1.0; 3] },
            generated_frames: GeneratedFrames::NormalsAndTangents,
            ..Mesh::default()
        };
        let skin = Skin { joints: vec![0, 1], inverse_bind: vec![DAffine3::IDENTITY; 2], ..Skin::default() };
        let nodes = [DAffine3::IDENTITY, DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2)];
        let shape = MeshDeformer::new(&mesh, &[], Some(&skin), &nodes).unwrap().deform();
        assert!(shape.normals.iter().all(|n| n.abs_diff_eq(Vec3::Y, 1e-6)), "{:?}", shape.normals);
        let along = Vec4::new(0.0, 0.0, -1.0, -1.0);
        assert!(shape.tangents.iter().all(|t| t.abs_diff_eq(along, 1e-6)), "{:?}", shape.tangents);
    }

    /// A mesh below a mirrored node is the same with a skin as without one: the mirror image of its frames.
    #[test]
    fn frames_are_mirrored_by_joints() {
        for generated_frames in [GeneratedFrames::NormalsAndTangents, GeneratedFrames::None] {
            let mesh = Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
                triangles: vec![[0, 1, 2]],
                normals: vec![Vec3::Z; 3],
                tangents: vec![Vec4::new(0.6, 0.8, 0.0, 1.0); 3],
                influences: Influences { per_vertex: 1, joints: vec![0; 3], weights: vec![1.0; 3] },
                generated_frames,
                ..Mesh::default()
            };
            let skin = Skin { joints: vec![0], inverse_bind: vec![DAffine3::IDENTITY], ..Skin::default() };
            for (scale, normal, tangent) in [
                (DVec3::new(-1.0, 1.0, 1.0), Vec3::Z, Vec4::new(-0.6, 0.8, 0.0, -1.0)),
                (DVec3::new(1.0, 1.0, -1.0), Vec3::NEG_Z, Vec4::new(0.6, 0.8, 0.0, -1.0)),
                (DVec3::NEG_ONE, Vec3::NEG_Z, Vec4::new(-0.6, -0.8, 0.0, -1.0)),
                (DVec3::new(-1.0, -1.0, 1.0), Vec3::Z, Vec4::new(-0.6, -0.8, 0.0, 1.0)),
            ] {
                let nodes = [DAffine3::from_scale(scale)];
                let shape = MeshDeformer::new(&mesh, &[], Some(&skin), &nodes).unwrap().deform();
                assert!(
                    shape.normals.iter().all(|n| n.abs_diff_eq(normal, 1e-6)),
                    "{scale}: {:?}",
                    shape.normals
                );
                assert!(
                    shape.tangents.iter().all(|t| t.abs_diff_eq(tangent, 1e-6)),
                    "{scale}: {:?}",
                    shape.tangents
                );
            }
        }
    }

    #[test]
    fn degenerate_triangles_keep_their_frames() {
        for to in [Vec3::ZERO, Vec3::X, Vec3::NAN, Vec3::INFINITY] {
            let flat = morphed(GeneratedFrames::NormalsAndTangents, to);
            assert_eq!((flat.normals[0], flat.tangents[0].y), (Vec3::Z, 1.0), "{to}");
        }
    }
}
