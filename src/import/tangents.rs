//! Generates tangents by MikkTSpace, as the glTF specification requires: normal maps are
//! baked in this tangent space.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3, Vec4};

use super::flat;
use blinn_scene::{GeneratedFrames, Influences, Mesh, MorphTarget, Source, TangentAxes, UvTransform};

#[cfg(test)]
mod tests;

/// Faces that may share a position: MikkTSpace compares all pairs.
const MAX_VALENCE: u32 = 1024;

/// Cosine of the smallest angle between a usable tangent and the normal, 0.1°.
const MAX_COSINE: f32 = 0.999_998;

/// Generates tangents of `mesh` along texture coordinates. Splits vertices whose faces have
/// different tangents. A mesh without normals gets face normals. Tangents that the mesh has are kept where they
/// are usable: finite, not 0, and not parallel to the normal.
///
/// The tangents follow rotations and reflections of the coordinates' transform (KHR_texture_transform),
/// except in Blender's files: Blender's normal maps use the axes of the untransformed coordinates.
pub(super) fn generate(mesh: &mut Mesh, axes: TangentAxes, source: &Source) {
    let TangentAxes { uv_set, transform } = axes;
    if mesh.uv_set(uv_set).is_none() {
        return;
    }
    let Some(own_tangents) = take_usable_tangents(mesh) else { return };
    if own_tangents.is_empty() {
        mesh.generated_frames = GeneratedFrames::Tangents;
    }
    if mesh.normals.is_empty() {
        flat::generate_normals(mesh);
        mesh.generated_frames = GeneratedFrames::NormalsAndTangents;
    }
    let uvs = &mesh.uvs[uv_set as usize];
    let transform = if source.is_blender() { UvTransform::IDENTITY } else { transform };
    let uvs: Vec<Vec2> = uvs.iter().map(|&uv| transform.apply(uv)).collect();
    let Faces { unique, duplicates } = select_faces(mesh, &uvs);
    let tangents = vec![None; mesh.triangles.len() * 3];
    let mut input = MikkMesh { mesh, uvs: &uvs, faces: &unique, tangents };
    let Ok(()) = generate_tangents(&mut input) else { return };
    let mut tangents = input.tangents;
    for Duplicate { triangle, original, rotation } in duplicates {
        for corner in 0..3 {
            tangents[triangle as usize * 3 + (corner + rotation) % 3] =
                tangents[original as usize * 3 + corner];
        }
    }
    for (t, corners) in mesh.triangles.iter().zip(tangents.chunks_exact_mut(3)) {
        // Corners that MikkTSpace skipped or has no tangent for use the face's direction of u.
        if corners.contains(&None) {
            let fallback = face_tangent(mesh, &uvs, t);
            corners.iter_mut().for_each(|c| *c = c.or(fallback));
        }
    }
    for (tangent, &v) in tangents.iter_mut().zip(mesh.triangles.as_flattened()) {
        if let Some(own) = own_tangents.get(v as usize).filter(|own| own.is_some()) {
            *tangent = *own;
        }
    }
    split_vertices(mesh, &tangents);
}

/// Removes the tangents of a mesh and returns those that are usable; empty if there are none. Returns `None`,
/// and removes nothing, if all tangents are usable.
fn take_usable_tangents(mesh: &mut Mesh) -> Option<Vec<Option<Vec4>>> {
    // Usable tangents and normals have been normalized. A normal that has not does not reject a tangent.
    let is_usable = |(tangent, normal): (&Vec4, &Vec3)| {
        let t = tangent.truncate();
        let is_parallel = normal.dot(t).abs() > MAX_COSINE;
        (t.length_squared() - 1.0).abs() < 0.1 && !is_parallel
    };
    let mut usable = mesh.tangents.iter().zip(&mesh.normals).map(is_usable);
    if !mesh.tangents.is_empty() && usable.all(|usable| usable) {
        return None;
    }
    let tangents = std::mem::take(&mut mesh.tangents);
    let own: Vec<Option<Vec4>> =
        tangents.iter().zip(&mesh.normals).map(|pair| is_usable(pair).then_some(*pair.0)).collect();
    if own.iter().any(Option::is_some) {
        return Some(own);
    }
    mesh.morph_targets.iter_mut().for_each(|target| target.tangents.clear());
    Some(Vec::new())
}

/// The triangles that MikkTSpace processes.
struct Faces {
    unique: Vec<u32>,
    duplicates: Vec<Duplicate>,
}

/// A triangle with the same corners as another.
struct Duplicate {
    triangle: u32,
    original: u32,
    /// Position of the original's first corner in the duplicate.
    rotation: usize,
}

/// Selects the triangles for MikkTSpace, whose time grows with the square of the faces at a position. Skips
/// triangles without area, with invalid numbers, or at positions of too many faces, and finds duplicates.
fn select_faces(mesh: &Mesh, uvs: &[Vec2]) -> Faces {
    let welded = weld(mesh.positions.len(), |v| {
        let p = mesh.positions[v];
        let n = mesh.normals[v];
        let t = uvs[v];
        [p.x, p.y, p.z, n.x, n.y, n.z, t.x, t.y]
    });
    let position_ids = weld(mesh.positions.len(), |v| mesh.positions[v].to_array());
    let mut out = Faces { unique: Vec::with_capacity(mesh.triangles.len()), duplicates: Vec::new() };
    let mut first: HashMap<[u32; 3], (u32, usize)> = HashMap::with_capacity(mesh.triangles.len());
    let mut valence = vec![0u32; mesh.positions.len()];
    for (i, corners) in mesh.triangles.iter().enumerate() {
        let i = i as u32;
        if !is_valid(mesh, uvs, corners) {
            continue;
        }
        let own = corners.map(|v| welded[v as usize]);
        let start = (0..3).min_by_key(|&k| own[k]).unwrap_or(0);
        let rotated = [own[start], own[(start + 1) % 3], own[(start + 2) % 3]];
        match first.entry(rotated) {
            Entry::Occupied(entry) => {
                let (original, original_start) = *entry.get();
                let rotation = (start + 3 - original_start) % 3;
                out.duplicates.push(Duplicate { triangle: i, original, rotation });
            }
            Entry::Vacant(slot) => {
                slot.insert((i, start));
                corners.iter().for_each(|&v| valence[position_ids[v as usize] as usize] += 1);
                out.unique.push(i);
            }
        }
    }
    let has_low_valence = |&t: &u32| {
        let valences = mesh.triangles[t as usize].map(|v| valence[position_ids[v as usize] as usize]);
        valences.iter().all(|&valence| valence <= MAX_VALENCE)
    };
    out.unique.retain(has_low_valence);
    out
}

/// Assigns the same id to vertices with equal values.
fn weld<const N: usize>(vertices: usize, values: impl Fn(usize) -> [f32; N]) -> Vec<u32> {
    let mut ids: HashMap<[u32; N], u32> = HashMap::with_capacity(vertices);
    let id = |v: usize| {
        let next = ids.len() as u32;
        // Adding zero turns -0 into 0.
        *ids.entry(values(v).map(|x| (x + 0.0).to_bits())).or_insert(next)
    };
    (0..vertices).map(id).collect()
}

/// Returns true for a triangle with three distinct positions and values in MikkTSpace's range.
fn is_valid(mesh: &Mesh, uvs: &[Vec2], corners: &[u32; 3]) -> bool {
    const MAX_VALUE: f32 = 1e15;
    let bounded = |x: Vec3| x.is_finite() && x.abs().max_element() < MAX_VALUE;
    let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
    a != b
        && b != c
        && c != a
        && corners
            .iter()
            .map(|&v| v as usize)
            .all(|v| bounded(mesh.positions[v]) && bounded(mesh.normals[v]) && bounded(uvs[v].extend(0.0)))
}

/// Direction of increasing u on a triangle, with the bitangent's sign in w.
fn face_tangent(mesh: &Mesh, uvs: &[Vec2], corners: &[u32; 3]) -> Option<Vec4> {
    let [a, b, c] = corners.map(|v| mesh.positions[v as usize].as_dvec3());
    let [ta, tb, tc] = corners.map(|v| uvs[v as usize].as_dvec2());
    let [e1, e2] = [b - a, c - a];
    let [d1, d2] = [tb - ta, tc - ta];
    let area = d1.perp_dot(d2);
    let along = (e1 * d2.y - e2 * d1.y) * area.signum();
    // v points down in the image, so an upright image seen from the front has a negative area.
    let sign = if area < 0.0 { 1.0 } else { -1.0 };
    Some(along.try_normalize()?.as_vec3().extend(sign))
}

/// A mesh as MikkTSpace reads it.
struct MikkMesh<'m> {
    mesh: &'m Mesh,
    uvs: &'m [Vec2],
    faces: &'m [u32],
    tangents: Vec<Option<Vec4>>,
}

impl MikkMesh<'_> {
    fn corner(&self, face: usize, vert: usize) -> usize {
        self.faces[face] as usize * 3 + vert
    }

    fn vertex(&self, face: usize, vert: usize) -> usize {
        self.mesh.triangles.as_flattened()[self.corner(face, vert)] as usize
    }
}

impl Geometry for MikkMesh<'_> {
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
        // v points up in MikkTSpace and down in glTF.
        let uv = self.uvs[self.vertex(face, vert)];
        [uv.x, 1.0 - uv.y]
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, vert: usize) {
        let corner = self.corner(face, vert);
        self.tangents[corner] = space.map(|s| Vec4::from(s.tangent_encoded()));
    }
}

/// Stores each corner's tangent at its vertex, and splits vertices with several tangents.
fn split_vertices(mesh: &mut Mesh, tangents: &[Option<Vec4>]) {
    let vertices = mesh.positions.len();
    let mut own: Vec<Option<Vec4>> = vec![None; vertices];
    let mut copies: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    // The originals of the appended vertices, in order.
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
    append_copies(mesh, &copied);
    // Vertices without a tangent use any frame around their normal.
    let default = |v: usize| mesh.normals[v].any_orthonormal_vector().extend(1.0);
    mesh.tangents = own.iter().enumerate().map(|(v, t)| t.unwrap_or_else(|| default(v))).collect();
}

/// Appends copies of vertices with all their attributes.
pub(super) fn append_copies(mesh: &mut Mesh, copied: &[u32]) {
    fn grow<T: Copy>(list: &mut Vec<T>, copied: &[u32], width: usize) {
        if list.is_empty() {
            return;
        }
        list.reserve_exact(copied.len() * width);
        for &v in copied {
            let start = v as usize * width;
            list.extend_from_within(start..start + width);
        }
    }
    let Mesh { positions, normals, tangents, uvs, colors, morph_targets, influences, .. } = mesh;
    grow(positions, copied, 1);
    grow(normals, copied, 1);
    grow(tangents, copied, 1);
    grow(colors, copied, 1);
    uvs.iter_mut().for_each(|set| grow(set, copied, 1));
    for MorphTarget { name: _, positions, normals, tangents, uvs, colors } in morph_targets {
        grow(positions, copied, 1);
        grow(normals, copied, 1);
        grow(tangents, copied, 1);
        grow(colors, copied, 1);
        uvs.iter_mut().for_each(|set| grow(set, copied, 1));
    }
    let Influences { per_vertex, joints, weights } = influences;
    grow(joints, copied, *per_vertex);
    grow(weights, copied, *per_vertex);
}
