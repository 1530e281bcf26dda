//! Flat shading with explicit normals: a normal map needs a tangent frame at every corner.

use blinn_scene::{Influences, Mesh, MorphTarget};

/// Stores three vertices per triangle, each with the face normal.
pub(super) fn generate_normals(mesh: &mut Mesh) {
    let corners: Vec<u32> = mesh.triangles.as_flattened().to_vec();
    let Mesh { positions, tangents, uvs, colors, morph_targets, influences, .. } = mesh;
    gather(positions, &corners, 1);
    gather(tangents, &corners, 1);
    gather(colors, &corners, 1);
    uvs.iter_mut().for_each(|set| gather(set, &corners, 1));
    for MorphTarget { name: _, positions, normals, tangents, uvs, colors } in morph_targets {
        gather(positions, &corners, 1);
        gather(normals, &corners, 1);
        gather(tangents, &corners, 1);
        gather(colors, &corners, 1);
        uvs.iter_mut().for_each(|set| gather(set, &corners, 1));
    }
    let Influences { per_vertex, joints, weights } = influences;
    gather(joints, &corners, *per_vertex);
    gather(weights, &corners, *per_vertex);
    mesh.normals = mesh.positions.as_chunks::<3>().0.iter().fold(Vec::new(), |mut normals, corners| {
        let [a, b, c] = corners.map(|p| p.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        normals.extend([normal; 3]);
        normals
    });
    for (i, triangle) in mesh.triangles.iter_mut().enumerate() {
        let first = 3 * i as u32;
        *triangle = [first, first + 1, first + 2];
    }
}

/// Replaces per-vertex data of `width` elements by the data of `vertices`.
fn gather<T: Copy>(list: &mut Vec<T>, vertices: &[u32], width: usize) {
    if list.is_empty() {
        return;
    }
    let mut out = Vec::with_capacity(vertices.len() * width);
    for &v in vertices {
        let start = v as usize * width;
        out.extend_from_slice(&list[start..start + width]);
    }
    *list = out;
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3, Vec4};

    use super::*;

    #[test]
    fn a_folded_quad_gets_one_normal_per_triangle() {
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            uvs: vec![vec![Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE]],
            influences: Influences { per_vertex: 2, joints: (0..8).collect(), weights: vec![0.5; 8] },
            morph_targets: vec![MorphTarget {
                positions: vec![Vec3::ONE; 4],
                uvs: vec![vec![], vec![Vec2::ONE; 4]],
                colors: vec![Vec4::ONE; 4],
                ..MorphTarget::default()
            }],
            ..Mesh::default()
        };
        generate_normals(&mut mesh);
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(mesh.normals, [[Vec3::Z; 3], [Vec3::X; 3]].concat());
        assert_eq!(mesh.positions[3..], [Vec3::ZERO, Vec3::Y, Vec3::Z]);
        assert_eq!(mesh.uvs[0][5], Vec2::ONE);
        assert_eq!(mesh.influences.joints[6..], [0, 1, 4, 5, 6, 7]);
        let MorphTarget { positions, uvs, colors, .. } = &mesh.morph_targets[0];
        assert_eq!([positions.len(), uvs[0].len(), uvs[1].len(), colors.len()], [6, 0, 6, 6]);
        assert_eq!(mesh.influences.weights.len(), 12);
    }
}
