//! Frames that no file has: made of a mesh's rest shape, they go where its triangles are taken.

use glam::{DMat3, DVec3, Vec3};

use crate::scene::{DeformedMesh, Mesh};

/// What of a mesh's frames was made of its rest shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum GeneratedFrames {
    /// Nothing: the file says what becomes of them.
    #[default]
    None,
    /// The tangents.
    Tangents,
    /// The normals too: every triangle has its own, and vertices that no other uses.
    NormalsAndTangents,
}

/// Makes anew, for the shape that `mesh` was bent to, what was made of the one it has at rest.
pub(crate) fn carry(mesh: &Mesh, shape: &mut DeformedMesh) {
    if mesh.generated_frames == GeneratedFrames::None {
        return;
    }
    let mut tangents = vec![DVec3::ZERO; mesh.tangents.len()];
    for corners in mesh.triangles.iter().map(|t| t.map(|v| v as usize)) {
        let rest = frame(corners.map(|v| mesh.positions[v]));
        let Some((rest, now)) = rest.zip(frame(corners.map(|v| shape.positions[v]))) else { continue };
        let way = now * rest.inverse();
        for v in corners {
            if mesh.generated_frames == GeneratedFrames::NormalsAndTangents {
                shape.normals[v] = now.z_axis.as_vec3();
            }
            if let Some(tangent) = tangents.get_mut(v) {
                *tangent += (way * mesh.tangents[v].truncate().as_dvec3()).normalize_or_zero();
            }
        }
    }
    for ((tangent, along), normal) in shape.tangents.iter_mut().zip(tangents).zip(&shape.normals) {
        // Where all triangles are without area, as it is.
        if let Some(along) = along.reject_from(normal.as_dvec3()).try_normalize() {
            *tangent = along.as_vec3().extend(tangent.w);
        }
    }
}

/// Two edges of a triangle and its unit normal; `None` without an area.
fn frame([a, b, c]: [Vec3; 3]) -> Option<DMat3> {
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    let normal = (b - a).cross(c - a).try_normalize()?;
    Some(DMat3::from_cols(b - a, c - a, normal))
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, Vec4};

    use super::*;
    use crate::scene::animation::deform::MeshDeformer;
    use crate::scene::{Influences, MorphTarget, Skin};

    /// A triangle in z = 0 whose third corner a target takes to `to`, by a weight of 1.
    fn bent(generated_frames: GeneratedFrames, to: Vec3) -> DeformedMesh {
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
        MeshDeformer::new(&mesh, &[1.0], None, &[]).unwrap().whole()
    }

    #[test]
    fn a_flap_takes_its_frame_along() {
        let flap = bent(GeneratedFrames::NormalsAndTangents, Vec3::NEG_Z * 3.0);
        assert_eq!(flap.normals, [Vec3::Y; 3]);
        assert_eq!(flap.tangents, [Vec4::new(0.0, 0.0, -1.0, -1.0); 3]);
        // Where the file has normals, they stay as it says.
        let slanted = bent(GeneratedFrames::Tangents, Vec3::new(1.0, 1.0, 5.0));
        assert_eq!(slanted.normals, [Vec3::Z; 3]);
        let along = slanted.tangents[0].truncate();
        assert!(along.abs_diff_eq(Vec3::new(0.5f32.sqrt(), 0.5f32.sqrt(), 0.0), 1e-6), "{along}");
        assert_eq!(bent(GeneratedFrames::None, Vec3::NEG_Z).tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 3]);
    }

    /// Its normals were as smooth as its joints part gently, under a normal map alone.
    #[test]
    fn a_flat_triangle_stays_flat_where_joints_part() {
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
        let shape = MeshDeformer::new(&mesh, &[], Some(&skin), &nodes).unwrap().whole();
        assert!(shape.normals.iter().all(|n| n.abs_diff_eq(Vec3::Y, 1e-6)), "{:?}", shape.normals);
        let along = Vec4::new(0.0, 0.0, -1.0, -1.0);
        assert!(shape.tangents.iter().all(|t| t.abs_diff_eq(along, 1e-6)), "{:?}", shape.tangents);
    }

    #[test]
    fn what_has_no_area_keeps_its_frame() {
        for to in [Vec3::ZERO, Vec3::X, Vec3::NAN, Vec3::INFINITY] {
            let flat = bent(GeneratedFrames::NormalsAndTangents, to);
            assert_eq!((flat.normals[0], flat.tangents[0].y), (Vec3::Z, 1.0), "{to}");
        }
    }
}
