//! Generates tangents by MikkTSpace, as the glTF specification requires: normal maps are
//! baked in this tangent space.

use glam::{Vec2, Vec3, Vec4};

use super::flat;
use blinn_scene::{GeneratedFrames, Mesh, Source, TangentAxes, UvTransform};
use edges::{Duplicate, NONE, Neighbors, find_neighbors};
use groups::{CornerTangents, group_tangents};
pub(super) use split::append_copies;

mod average;
mod edges;
mod frames;
mod groups;
mod split;
#[cfg(test)]
mod tests;
mod welding;

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
    if mesh.uv_set(uv_set).is_none() || !has_indices(mesh) {
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
    let transform = if source.is_blender() { UvTransform::IDENTITY } else { transform };
    let uvs: Vec<Vec2> = mesh.uvs[uv_set as usize].iter().map(|&uv| transform.apply(uv)).collect();
    let mut tangents = corner_tangents(mesh, &uvs);
    fill_with_face_tangents(mesh, &uvs, &mut tangents);
    keep_own_tangents(mesh, &own_tangents, &mut tangents);
    split::split_vertices(mesh, &tangents);
}

/// Returns true if 32 bits count the tangents of all groups, faces and vertices.
fn has_indices(mesh: &Mesh) -> bool {
    let corners = mesh.triangles.len().saturating_mul(3);
    let vertices = mesh.positions.len().max(corners);
    let tangents = corners.saturating_add(mesh.triangles.len()).saturating_add(vertices);
    tangents < NONE as usize
}

/// Returns the tangents of MikkTSpace. Triangles with the same corners share them.
fn corner_tangents(mesh: &Mesh, uvs: &[Vec2]) -> CornerTangents {
    // v points up in MikkTSpace and down in glTF.
    let uvs: Vec<Vec2> = uvs.iter().map(|uv| Vec2::new(uv.x, 1.0 - uv.y)).collect();
    let mut welded = welding::weld_triangles(mesh, &uvs);
    let Neighbors { twins, duplicates } = find_neighbors(&mut welded, mesh.positions.len());
    let (frames, mappings) = frames::triangle_frames(mesh, &uvs, &welded);
    let mut out = group_tangents(mesh, &twins, &frames, mappings);
    for Duplicate { triangle, original, rotation } in duplicates {
        for k in 0..3 {
            out.corners[triangle as usize * 3 + (k + rotation) % 3] = out.corners[original as usize * 3 + k];
        }
    }
    out
}

/// Gives corners without a finite tangent of MikkTSpace the face's direction of u.
fn fill_with_face_tangents(mesh: &Mesh, uvs: &[Vec2], out: &mut CornerTangents) {
    let CornerTangents { tangents, corners } = out;
    for (triangle, corners) in mesh.triangles.iter().zip(corners.as_chunks_mut::<3>().0) {
        let is_usable = |&id: &u32| tangents.get(id as usize).is_some_and(|tangent| tangent.is_finite());
        let usable = [is_usable(&corners[0]), is_usable(&corners[1]), is_usable(&corners[2])];
        if usable == [true; 3] {
            continue;
        }
        let face = face_tangent(mesh, uvs, triangle);
        let id = face.map_or(NONE, |_| tangents.len() as u32);
        tangents.extend(face);
        corners.iter_mut().zip(usable).filter(|(_, usable)| !usable).for_each(|(corner, _)| *corner = id);
    }
}

/// Gives corners the usable tangents that their vertices have.
fn keep_own_tangents(mesh: &Mesh, own: &[Option<Vec4>], out: &mut CornerTangents) {
    if own.is_empty() {
        return;
    }
    let first = out.tangents.len() as u32;
    out.tangents.extend(own.iter().map(|own| own.unwrap_or_default()));
    for (corner, &v) in out.corners.iter_mut().zip(mesh.triangles.as_flattened()) {
        if own[v as usize].is_some() {
            *corner = first + v;
        }
    }
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
