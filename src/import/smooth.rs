//! Generates vertex normals by crease angle (`--smooth`), in place of the file's normals.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::tangents;
use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_scene::{GeneratedFrames, Mesh, Scene};

#[cfg(test)]
mod tests;

/// Source of the vertex normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub enum NormalMode {
    /// The file's normals, or its format's default for meshes without normals. The smoothing groups of programs that write
    /// the same for everything are replaced by a crease angle of 30 degrees.
    #[default]
    Auto,
    /// The file's normals and smoothing groups, or its format's default for meshes without normals.
    File,
    /// Face normals: every triangle is flat.
    Flat,
    /// Generated normals: smooth across edges whose face normals enclose less than this angle in degrees.
    CreaseAngle(f64),
}

impl NormalMode {
    /// Returns true if the file's normals are replaced.
    pub(super) fn generates(self) -> bool {
        !matches!(self, NormalMode::Auto | NormalMode::File)
    }
}

/// Replaces the normals of all meshes as `mode` requires, and the tangents of meshes with normal maps.
///
/// # Errors
/// The import was cancelled.
pub(super) fn apply(scene: &mut Scene, mode: NormalMode, cancel: &CancelToken) -> Result<(), Cancelled> {
    if !mode.generates() {
        return Ok(());
    }
    for mesh in scene.meshes.iter_mut().filter(|mesh| !mesh.has_rounds()) {
        mesh.normals = Vec::new();
        mesh.tangents = Vec::new();
        mesh.generated_frames = GeneratedFrames::None;
        for morph in &mut mesh.morph_targets {
            morph.normals = Vec::new();
            morph.tangents = Vec::new();
        }
    }
    if let NormalMode::CreaseAngle(degrees) = mode {
        for object in object_meshes(scene) {
            cancel.check()?;
            generate(&mut scene.meshes, &object, libm::cos(degrees.to_radians()));
        }
    }
    for mesh in scene.meshes.iter_mut().filter(|mesh| !mesh.has_rounds()) {
        if let Some(axes) = scene.materials.get(mesh.material as usize).and_then(|m| m.tangent_axes()) {
            cancel.check()?;
            tangents::generate(mesh, axes, &scene.source);
        }
    }
    Ok(())
}

/// Groups the meshes by object, so that a surface stays smooth where its material changes.
fn object_meshes(scene: &Scene) -> Vec<Vec<usize>> {
    let mut first: Vec<Option<(u32, u32)>> = vec![None; scene.meshes.len()];
    for instance in &scene.instances {
        first[instance.mesh as usize].get_or_insert((instance.node, instance.object));
    }
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut group_of = HashMap::new();
    for (mesh, first) in first.into_iter().enumerate().filter(|(mesh, _)| !scene.meshes[*mesh].has_rounds()) {
        let new = groups.len();
        let group = first.map_or(new, |f| *group_of.entry(f).or_insert(new));
        if group == new {
            groups.push(Vec::new());
        }
        groups[group].push(mesh);
    }
    groups
}

/// Angle in radians of a face at its corner `p`, between the edges to the neighbouring corners.
pub(super) fn angle_at(p: DVec3, neighbours: [DVec3; 2]) -> f64 {
    let [a, b] = neighbours.map(|q| (q - p).normalize_or_zero());
    libm::acos(a.dot(b).clamp(-1.0, 1.0))
}

/// Generates the normals of the meshes `object` as if they were one mesh, for the base shape and for every
/// morph target. An edge is smooth if the cosine of the angle between its face normals in the base shape
/// exceeds `min_cos`.
fn generate(meshes: &mut [Mesh], object: &[usize], min_cos: f64) {
    let faces = faces(meshes, object);
    let normals = face_normals(meshes, &faces, None);
    // Vertices at the same position are welded, whatever their other attributes.
    let mut ids: HashMap<[u32; 3], u32> = HashMap::new();
    let mut position_ids: Vec<u32> = Vec::with_capacity(faces.len() * 3);
    for face in &faces {
        for v in face.vertices {
            // Adding zero turns -0 into 0.
            let bits = (meshes[face.mesh].positions[v as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
            let next = ids.len() as u32;
            position_ids.push(*ids.entry(bits).or_insert(next));
        }
    }
    // Corners that are connected by smooth edges share one normal.
    let mut parents: Vec<u32> = (0..position_ids.len() as u32).collect();
    for [a, b] in smooth_corner_pairs(&position_ids, &normals, min_cos) {
        union(&mut parents, a, b);
    }
    let roots: Vec<u32> = (0..parents.len() as u32).map(|c| find_root(&mut parents, c)).collect();
    let mut start = 0;
    for &m in object {
        let corners = start..start + 3 * meshes[m].triangles.len();
        split_vertices(&mut meshes[m], &roots[corners.clone()]);
        start = corners.end;
    }
    let morph_targets = object.iter().map(|&m| meshes[m].morph_targets.len()).max().unwrap_or(0);
    for morph in [None].into_iter().chain((0..morph_targets).map(Some)) {
        let normals = corner_normals(meshes, object, morph, &roots);
        let mut normals = &normals[..];
        for &m in object {
            let mesh = &mut meshes[m];
            let own = normals.split_off(..3 * mesh.triangles.len()).unwrap_or_default();
            store_normals(mesh, morph, own);
        }
    }
}

/// Stores the normals of a mesh's corners: as the base normals, or as their differences to them in a morph
/// target.
fn store_normals(mesh: &mut Mesh, morph: Option<usize>, corners: &[Vec3]) {
    let corners = || mesh.triangles.as_flattened().iter().map(|&v| v as usize).zip(corners);
    let Some(target) = morph else {
        mesh.normals = vec![Vec3::Y; mesh.positions.len()];
        corners().for_each(|(v, &normal)| mesh.normals[v] = normal);
        return;
    };
    let Some(target) = mesh.morph_targets.get_mut(target).filter(|target| !target.positions.is_empty())
    else {
        return;
    };
    target.normals = vec![Vec3::ZERO; mesh.positions.len()];
    corners().for_each(|(v, &normal)| target.normals[v] = normal - mesh.normals[v]);
}

/// A triangle of one of several meshes.
struct Face {
    mesh: usize,
    vertices: [u32; 3],
}

/// Unit normals of faces in the base shape or in a morph target; 0 for faces without area.
fn face_normals(meshes: &[Mesh], faces: &[Face], morph: Option<usize>) -> Vec<DVec3> {
    let normal = |face: &Face| {
        let [a, b, c] = corner_positions(&meshes[face.mesh], &face.vertices, morph);
        (b - a).cross(c - a).normalize_or_zero()
    };
    faces.par_iter().map(normal).collect()
}

/// Positions of a face's corners in the base shape or in a morph target.
fn corner_positions(mesh: &Mesh, vertices: &[u32; 3], morph: Option<usize>) -> [DVec3; 3] {
    let target = morph.and_then(|target| mesh.morph_targets.get(target));
    let delta = |v: u32| target.and_then(|t| t.positions.get(v as usize)).copied().unwrap_or_default();
    vertices.map(|v| mesh.positions[v as usize].as_dvec3() + delta(v).as_dvec3())
}

/// Unit normals of all corners in the base shape or in a morph target: face normals averaged over the corners
/// with the same root, weighted by the corners' angles.
fn corner_normals(meshes: &[Mesh], object: &[usize], morph: Option<usize>, roots: &[u32]) -> Vec<Vec3> {
    let faces = faces(meshes, object);
    let normals = face_normals(meshes, &faces, morph);
    let mut sums = vec![DVec3::ZERO; roots.len()];
    for (i, face) in faces.iter().enumerate() {
        let p = corner_positions(&meshes[face.mesh], &face.vertices, morph);
        for k in 0..3 {
            let angle = angle_at(p[k], [p[(k + 1) % 3], p[(k + 2) % 3]]);
            sums[roots[3 * i + k] as usize] += normals[i] * angle;
        }
    }
    let unit = |(corner, &root): (usize, &u32)| {
        // Where the face normals cancel out, the corner uses its own face's.
        let n = sums[root as usize].try_normalize().unwrap_or(normals[corner / 3]);
        n.try_normalize().unwrap_or(DVec3::Y).as_vec3()
    };
    roots.iter().enumerate().map(unit).collect()
}

/// The triangles of the meshes `object`.
fn faces(meshes: &[Mesh], object: &[usize]) -> Vec<Face> {
    let of_mesh = |&mesh: &usize| meshes[mesh].triangles.iter().map(move |&vertices| Face { mesh, vertices });
    object.iter().flat_map(of_mesh).collect()
}

/// Pairs of corners at both ends of all smooth edges.
fn smooth_corner_pairs(position_ids: &[u32], normals: &[DVec3], min_cos: f64) -> Vec<[u32; 2]> {
    /// Faces at one edge up to which all pairs are compared; edges of more faces are sharp.
    const MAX_FACES: usize = 16;
    // Edges by the ids of their positions, each with the corner that it starts from.
    let next = |c: u32| if c % 3 == 2 { c - 2 } else { c + 1 };
    let mut edges: Vec<([u32; 2], u32)> = (0..position_ids.len() as u32)
        .map(|c| {
            let [a, b] = [c, next(c)].map(|c| position_ids[c as usize]);
            ([a.min(b), a.max(b)], c)
        })
        .filter(|(ids, _)| ids[0] != ids[1])
        .collect();
    edges.par_sort_unstable();
    let mut out = Vec::new();
    for same in edges.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() <= MAX_FACES) {
        for (i, &(_, c)) in same.iter().enumerate() {
            for &(_, d) in &same[i + 1..] {
                if normals[c as usize / 3].dot(normals[d as usize / 3]) <= min_cos {
                    continue;
                }
                let is_reversed = position_ids[c as usize] != position_ids[d as usize];
                let [start, end] = if is_reversed { [next(d), d] } else { [d, next(d)] };
                out.extend([[c, start], [next(c), end]]);
            }
        }
    }
    out
}

/// Root of a set in a union-find forest, with path halving.
fn find_root(parents: &mut [u32], mut c: u32) -> u32 {
    while parents[c as usize] != c {
        parents[c as usize] = parents[parents[c as usize] as usize];
        c = parents[c as usize];
    }
    c
}

/// Unites two sets.
fn union(parents: &mut [u32], a: u32, b: u32) {
    let [a, b] = [a, b].map(|c| find_root(parents, c));
    // The lower root remains, so that the order of unions does not matter.
    parents[a.max(b) as usize] = a.min(b);
}

/// Duplicates each vertex so that all its corners have the same key. `keys` has one for each corner.
pub(super) fn split_vertices(mesh: &mut Mesh, keys: &[u32]) {
    let vertices = mesh.positions.len();
    let mut own: Vec<Option<u32>> = vec![None; vertices];
    let mut copies: HashMap<(u32, u32), u32> = HashMap::new();
    let mut copied: Vec<u32> = Vec::new();
    for (corner, &key) in mesh.triangles.as_flattened_mut().iter_mut().zip(keys) {
        let vertex = *corner;
        if *own[vertex as usize].get_or_insert(key) != key {
            *corner = *copies.entry((vertex, key)).or_insert_with(|| {
                copied.push(vertex);
                (vertices + copied.len() - 1) as u32
            });
        }
    }
    tangents::append_copies(mesh, &copied);
}
