//! Tangents for normal maps, by MikkTSpace as the specification asks: the frame that the maps were
//! baked in.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};

use super::flat;
use crate::scene::{GeneratedFrames, Influences, Mesh, MorphTarget, Source, TextureRef, UvTransform};

/// Faces that may meet in a place: MikkTSpace compares each with each.
const MOST_FACES: u32 = 1024;

/// Gives `mesh` tangents along the coordinates of `map`, unless it has some. Vertices where the
/// frames of neighbouring faces differ are split; a flat mesh gets its faces' normals.
///
/// The frame follows what the map's transform turns or mirrors, but not in Blender's files: its normal maps
/// have the axes of the coordinates themselves, and so have the tangents that it writes.
pub(super) fn generate(mesh: &mut Mesh, map: &TextureRef, source: &Source) {
    let has_uvs = mesh.uv_set(map.uv_set).is_some();
    if !has_uvs || !mesh.tangents.is_empty() {
        return;
    }
    mesh.generated_frames = GeneratedFrames::Tangents;
    if mesh.normals.is_empty() {
        flat::generate_normals(mesh);
        mesh.generated_frames = GeneratedFrames::NormalsAndTangents;
    }
    let uvs = &mesh.uvs[map.uv_set as usize];
    let axes = if source.is_blender() { UvTransform::IDENTITY } else { map.transform };
    let uvs: Vec<Vec2> = uvs.iter().map(|&uv| axes.apply(uv)).collect();
    let Faces { plain, copies } = faces(mesh, &uvs);
    let tangents = vec![None; mesh.triangles.len() * 3];
    let mut corners = Corners { mesh, uvs: &uvs, faces: &plain, tangents };
    let Ok(()) = generate_tangents(&mut corners) else { return };
    let mut tangents = corners.tangents;
    for (copy, of, turn) in copies {
        for corner in 0..3 {
            tangents[copy as usize * 3 + (corner + turn) % 3] = tangents[of as usize * 3 + corner];
        }
    }
    for (t, corners) in mesh.triangles.iter().zip(tangents.chunks_exact_mut(3)) {
        // Where MikkTSpace was not asked or has no answer: the face's own direction of u.
        if corners.contains(&None) {
            let own = face_tangent(mesh, &uvs, t);
            corners.iter_mut().for_each(|c| *c = c.or(own));
        }
    }
    split(mesh, &tangents);
}

/// Which triangles MikkTSpace is asked about.
struct Faces {
    plain: Vec<u32>,
    /// Triangles that repeat another: (the copy, the other, where its first corner is).
    copies: Vec<(u32, u32, usize)>,
}

/// Leaves out what has no area, or numbers that nobody can work with, or too many neighbours, and
/// asks once for triangles that are there many times: MikkTSpace's time grows with the square.
fn faces(mesh: &Mesh, uvs: &[Vec2]) -> Faces {
    let welded = weld(mesh.positions.len(), |v| {
        let (p, n, t) = (mesh.positions[v], mesh.normals[v], uvs[v]);
        [p.x, p.y, p.z, n.x, n.y, n.z, t.x, t.y]
    });
    let places = weld(mesh.positions.len(), |v| mesh.positions[v].to_array());
    let mut out = Faces { plain: Vec::with_capacity(mesh.triangles.len()), copies: Vec::new() };
    let mut first: HashMap<[u32; 3], (u32, usize)> = HashMap::with_capacity(mesh.triangles.len());
    let mut valence = vec![0u32; mesh.positions.len()];
    for (i, corners) in mesh.triangles.iter().enumerate() {
        let i = i as u32;
        if !is_plain(mesh, uvs, corners) {
            continue;
        }
        let own = corners.map(|v| welded[v as usize]);
        let turn = (0..3).min_by_key(|&k| own[k]).unwrap_or(0);
        let turned = [own[turn], own[(turn + 1) % 3], own[(turn + 2) % 3]];
        match first.entry(turned) {
            Entry::Occupied(other) => {
                let (of, of_turn) = *other.get();
                out.copies.push((i, of, (turn + 3 - of_turn) % 3));
            }
            Entry::Vacant(slot) => {
                slot.insert((i, turn));
                corners.iter().for_each(|&v| valence[places[v as usize] as usize] += 1);
                out.plain.push(i);
            }
        }
    }
    let few = |&t: &u32| {
        mesh.triangles[t as usize].iter().all(|&v| valence[places[v as usize] as usize] <= MOST_FACES)
    };
    out.plain.retain(few);
    out
}

/// Gives vertices with equal numbers one id.
fn weld<const N: usize>(vertices: usize, numbers: impl Fn(usize) -> [f32; N]) -> Vec<u32> {
    let mut ids: HashMap<[u32; N], u32> = HashMap::with_capacity(vertices);
    let id = |v: usize| {
        let next = ids.len() as u32;
        // Adding zero makes one of both zeros.
        *ids.entry(numbers(v).map(|x| (x + 0.0).to_bits())).or_insert(next)
    };
    (0..vertices).map(id).collect()
}

/// True for a triangle with an area, and numbers that MikkTSpace can work with.
fn is_plain(mesh: &Mesh, uvs: &[Vec2], corners: &[u32; 3]) -> bool {
    const HUGE: f32 = 1e15;
    let bounded = |x: Vec3| x.is_finite() && x.abs().max_element() < HUGE;
    let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
    a != b
        && b != c
        && c != a
        && corners
            .iter()
            .map(|&v| v as usize)
            .all(|v| bounded(mesh.positions[v]) && bounded(mesh.normals[v]) && bounded(uvs[v].extend(0.0)))
}

/// Where u grows fastest on a triangle, with the sign of its bitangent.
fn face_tangent(mesh: &Mesh, uvs: &[Vec2], corners: &[u32; 3]) -> Option<Vec4> {
    let [a, b, c] = corners.map(|v| mesh.positions[v as usize].as_dvec3());
    let [ta, tb, tc] = corners.map(|v| uvs[v as usize].as_dvec2());
    let (e1, e2, d1, d2) = (b - a, c - a, tb - ta, tc - ta);
    let area = d1.perp_dot(d2);
    let along = (e1 * d2.y - e2 * d1.y) * area.signum();
    // v runs down the image, so an image seen upright from the front has a negative area.
    let sign = if area < 0.0 { 1.0 } else { -1.0 };
    Some(along.try_normalize()?.as_vec3().extend(sign))
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
pub(super) fn append(mesh: &mut Mesh, copied: &[u32]) {
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
    let Mesh { positions, normals, uvs, colors, morph_targets, influences, .. } = mesh;
    grow(positions, copied, 1);
    grow(normals, copied, 1);
    grow(colors, copied, 1);
    uvs.iter_mut().for_each(|set| grow(set, copied, 1));
    for MorphTarget { positions, normals, tangents, .. } in morph_targets {
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

    /// A map that is turned turns the frame, but in Blender's files.
    #[test]
    fn the_frame_follows_the_map_as_its_program_has_it() {
        let quarter = UvTransform::khr(Vec2::ZERO, std::f32::consts::FRAC_PI_2, Vec2::ONE);
        let map = TextureRef { transform: quarter, ..map() };
        for (generator, along) in [("", Vec3::Y), ("Khronos glTF Blender I/O v5.0.21", Vec3::X)] {
            let mut mesh = square();
            generate(&mut mesh, &map, &Source { generator: generator.into(), ..Source::default() });
            let t = mesh.tangents[0].truncate();
            assert!(t.dot(along).abs() > 0.999, "{generator}: {t}");
        }
    }

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
        generate(&mut mesh, &map(), &Source::default());
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
        generate(&mut mesh, &map(), &Source::default());
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
            generate(&mut mesh, &map(), &Source::default());
            assert_eq!(mesh.tangents.len(), mesh.positions.len());
        }
    }

    /// Few different numbers, so that vertices, edges and triangles coincide in every way.
    fn tangle() -> impl proptest::strategy::Strategy<Value = Mesh> {
        use proptest::prelude::*;
        let number = || prop_oneof![Just(0.0f32), Just(1.0), Just(-1.0), Just(1e-30), Just(1e14)];
        let vertex = (number(), number(), number(), number(), number(), 0..4usize);
        let normals = [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::ZERO];
        (1..12usize).prop_flat_map(move |n| {
            let vertices = prop::collection::vec(vertex.clone(), n);
            let triangles = prop::collection::vec(prop::array::uniform3(0..n as u32), 1..24);
            (vertices, triangles).prop_map(move |(vertices, triangles)| Mesh {
                positions: vertices.iter().map(|v| Vec3::new(v.0, v.1, v.2)).collect(),
                normals: vertices.iter().map(|v| normals[v.5]).collect(),
                uvs: vec![vertices.iter().map(|v| Vec2::new(v.3, v.4)).collect()],
                triangles,
                ..Mesh::default()
            })
        })
    }

    proptest::proptest! {
        #![proptest_config(proptest::prelude::ProptestConfig::with_cases(4000))]
        #[test]
        fn tangled_meshes_keep_their_shape(mesh in tangle()) {
            let mut split = mesh.clone();
            generate(&mut split, &map(), &Source::default());
            assert_eq!(split.tangents.len(), split.positions.len());
            assert_eq!(split.uvs[0].len(), split.positions.len());
            for (a, b) in mesh.triangles.as_flattened().iter().zip(split.triangles.as_flattened()) {
                let (a, b) = (*a as usize, *b as usize);
                assert_eq!((mesh.positions[a], mesh.normals[a]), (split.positions[b], split.normals[b]));
            }
        }
    }

    #[test]
    fn repeated_triangles_share_their_frames() {
        let mut mesh = square();
        mesh.uvs[0][3] = Vec2::new(1.0, 1.0);
        let mut alone = mesh.clone();
        generate(&mut alone, &map(), &Source::default());
        mesh.triangles.extend([[1, 2, 0], [3, 0, 2]]);
        generate(&mut mesh, &map(), &Source::default());
        assert_eq!((&mesh.positions, &mesh.tangents), (&alone.positions, &alone.tangents));
        let turned: Vec<[u32; 3]> = [mesh.triangles[2], mesh.triangles[3]]
            .iter()
            .zip([2, 1])
            .map(|(t, by)| [t[by], t[(by + 1) % 3], t[(by + 2) % 3]])
            .collect();
        assert_eq!(turned, alone.triangles);
    }

    #[test]
    fn many_coincident_triangles_take_no_longer_than_others() {
        let n = 100_000;
        let start = std::time::Instant::now();
        let mut same = square();
        same.triangles = same.triangles.repeat(n / 2);
        generate(&mut same, &map(), &Source::default());
        assert_eq!(same.positions.len(), 4);
        // One place, coordinates of their own; a fan about one vertex; no area at all.
        for kind in 0..3 {
            let mut mesh = Mesh { uvs: vec![Vec::new()], ..Mesh::default() };
            for i in 0..n as u32 {
                let f = i as f32 * 1e-3;
                let corners = match kind {
                    0 => [Vec3::ZERO, Vec3::X, Vec3::Y],
                    1 => [Vec3::ZERO, Vec3::new(f, 1.0, 0.0), Vec3::new(f + 1e-3, 1.0, 0.0)],
                    _ => [Vec3::ZERO; 3],
                };
                let shift = if kind == 1 { 0.0 } else { f };
                mesh.positions.extend(corners);
                mesh.normals.extend([Vec3::Z; 3]);
                mesh.uvs[0].extend([Vec2::new(shift, 0.0), Vec2::new(shift + 1.0, f), Vec2::new(shift, 1.0)]);
                mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
            }
            generate(&mut mesh, &map(), &Source::default());
            assert!(mesh.tangents.iter().all(|t| t.is_finite()));
        }
        // Quadratic time would be minutes.
        assert!(start.elapsed().as_secs() < 60, "{:?}", start.elapsed());
    }
}
