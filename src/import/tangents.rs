//! Tangents for normal maps, by MikkTSpace as the specification asks: the frame that the maps were
//! baked in.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};

use crate::scene::{Influences, Mesh, MorphTarget, TextureRef};

/// Gives `mesh` tangents along the coordinates of `map`, unless it has some, or no normals to make
/// them from. Vertices where the frames of neighbouring faces differ are split.
pub(super) fn generate(mesh: &mut Mesh, map: &TextureRef) {
    let uvs = mesh.uvs.get(map.uv_set as usize).filter(|s| !s.is_empty());
    let Some(uvs) = uvs.filter(|_| mesh.tangents.is_empty() && !mesh.normals.is_empty()) else { return };
    // The map's own axes: what it turns or mirrors, the frame follows.
    let uvs: Vec<Vec2> = uvs.iter().map(|&uv| map.transform.apply(uv)).collect();
    let faces: Vec<u32> = (0..mesh.triangles.len() as u32).filter(|&t| is_plain(mesh, &uvs, t)).collect();
    let corners = vec![None; mesh.triangles.len() * 3];
    let mut corners = Corners { mesh, uvs: &uvs, faces: &faces, tangents: corners };
    let Ok(()) = generate_tangents(&mut corners) else { return };
    let tangents = corners.tangents;
    split(mesh, &tangents);
}

/// Triangles with numbers that MikkTSpace can work with.
fn is_plain(mesh: &Mesh, uvs: &[Vec2], triangle: u32) -> bool {
    const HUGE: f32 = 1e15;
    mesh.triangles[triangle as usize].iter().all(|&v| {
        let v = v as usize;
        let bounded = |x: Vec3| x.is_finite() && x.abs().max_element() < HUGE;
        bounded(mesh.positions[v]) && bounded(mesh.normals[v]) && bounded(uvs[v].extend(0.0))
    })
}

struct Corners<'m> {
    mesh: &'m Mesh,
    uvs: &'m [Vec2],
    faces: &'m [u32],
    tangents: Vec<Option<Vec4>>,
}

impl Corners<'_> {
    fn corner(&self, face: usize, vert: usize) -> usize {
        self.faces[face] as usize * 3 + vert
    }

    fn vertex(&self, face: usize, vert: usize) -> usize {
        self.mesh.triangles.as_flattened()[self.corner(face, vert)] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, vert)].into()
    }

    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, vert)].into()
    }

    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        // MikkTSpace has v upwards, glTF downwards.
        let uv = self.uvs[self.vertex(face, vert)];
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, vert: usize) {
        let corner = self.corner(face, vert);
        self.tangents[corner] = space.map(|s| Vec4::from(s.tangent_encoded()));
    }
}

/// Hands each vertex its corners' tangent, and a vertex with several its copies.
fn split(mesh: &mut Mesh, tangents: &[Option<Vec4>]) {
    let vertices = mesh.positions.len();
    let mut own: Vec<Option<Vec4>> = vec![None; vertices];
    let mut copies: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    // The vertices that are copied, in the order of their copies.
    let mut copied: Vec<u32> = Vec::new();
    for (corner, tangent) in mesh.triangles.as_flattened_mut().iter_mut().zip(tangents) {
        let Some(tangent) = *tangent else { continue };
        let vertex = *corner as usize;
        match own[vertex] {
            None => own[vertex] = Some(tangent),
            Some(first) if first == tangent => {}
            Some(_) => {
                let key = (*corner, tangent.to_array().map(f32::to_bits));
                let next = (vertices + copied.len()) as u32;
                *corner = *copies.entry(key).or_insert_with(|| {
                    copied.push(vertex as u32);
                    next
                });
                if *corner == next && own.len() == next as usize {
                    own.push(Some(tangent));
                }
            }
        }
    }
    append(mesh, &copied);
    // Corners that MikkTSpace has nothing to say of: any frame about their normal.
    let default = |v: usize| mesh.normals[v].any_orthonormal_vector().extend(1.0);
    mesh.tangents = own.iter().enumerate().map(|(v, t)| t.unwrap_or_else(|| default(v))).collect();
}

/// Appends copies of vertices, with everything they carry.
fn append(mesh: &mut Mesh, copied: &[u32]) {
    fn grow<T: Copy>(list: &mut Vec<T>, copied: &[u32], each: usize) {
        if list.is_empty() {
            return;
        }
        list.reserve_exact(copied.len() * each);
        for &v in copied {
            let start = v as usize * each;
            list.extend_from_within(start..start + each);
        }
    }
    let Mesh { positions, normals, uvs, colors, morphs, influences, .. } = mesh;
    grow(positions, copied, 1);
    grow(normals, copied, 1);
    grow(colors, copied, 1);
    uvs.iter_mut().for_each(|set| grow(set, copied, 1));
    for MorphTarget { positions, normals, tangents, .. } in morphs {
        grow(positions, copied, 1);
        grow(normals, copied, 1);
        grow(tangents, copied, 1);
    }
    let Influences { per_vertex, joints, weights } = influences;
    grow(joints, copied, *per_vertex);
    grow(weights, copied, *per_vertex);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::UvTransform;

    fn map() -> TextureRef {
        TextureRef { texture: 0, uv_set: 0, transform: UvTransform::IDENTITY }
    }

    /// A square of two triangles in the plane z = 0, its image right way up.
    fn square() -> Mesh {
        Mesh {
            positions: [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
                .map(|(x, y)| Vec3::new(x, y, 0.0))
                .into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            normals: vec![Vec3::Z; 4],
            uvs: vec![[(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(|(u, v)| Vec2::new(u, v)).into()],
            ..Mesh::default()
        }
    }

    #[test]
    fn an_upright_image_has_the_frame_of_its_plane() {
        let mut mesh = square();
        generate(&mut mesh, &map());
        // t along +u, and b = cross(n, t)·w along the image's up.
        assert_eq!(mesh.tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 4]);
        assert_eq!(mesh.positions.len(), 4);
    }

    #[test]
    fn a_mirrored_half_splits_the_seam() {
        let mut mesh = square();
        // The second triangle is folded back onto the image.
        mesh.uvs[0][3] = Vec2::new(1.0, 1.0);
        mesh.colors = (0..4).map(|i| Vec4::splat(i as f32)).collect();
        generate(&mut mesh, &map());
        assert_eq!((mesh.positions.len(), mesh.tangents.len(), mesh.uvs[0].len()), (6, 6, 6));
        let signs: Vec<[f32; 3]> =
            mesh.triangles.iter().map(|t| t.map(|v| mesh.tangents[v as usize].w)).collect();
        assert_eq!(signs, [[1.0; 3], [-1.0; 3]]);
        for t in &mesh.triangles {
            assert!(t.iter().all(|&v| mesh.positions[v as usize].is_finite()));
        }
        assert_eq!(
            mesh.colors[4],
            mesh.colors[mesh.positions.iter().position(|p| *p == mesh.positions[4]).unwrap()]
        );
    }

    #[test]
    fn wild_numbers_do_no_harm() {
        for wild in [f32::NAN, f32::INFINITY, 1e38, 0.0] {
            let mut mesh = square();
            mesh.positions[2] = Vec3::splat(wild);
            mesh.uvs[0][1] = Vec2::splat(wild);
            mesh.normals[0] = Vec3::splat(wild);
            generate(&mut mesh, &map());
            assert_eq!(mesh.tangents.len(), mesh.positions.len());
        }
    }
}
