//! Builds meshes from triangles: one per object, material and vertex format, with welded vertices.

use std::collections::HashMap;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::super::{Limits, LoadError};
use super::chunk::NO_INDEX;
use super::geometry::ObjGeometry;
use super::segment::Segment;
use super::welding::Welder;
use crate::polygons::used_vertices::UsedVertices;
use crate::polygons::vertex_dedup::VertexDeduplicator;
use blinn_scene::Mesh;

/// The state that all triangles of a mesh share. Smoothing groups share a mesh, since a file may have one
/// per face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct MeshKey {
    pub object: u32,
    /// Index into [`ObjGeometry::materials`].
    pub material: Option<u32>,
    has_uv: bool,
    flat: bool,
}

impl MeshKey {
    /// The key of points or lines.
    pub fn of_rounds(object: u32, material: Option<u32>) -> MeshKey {
        MeshKey { object, material, has_uv: false, flat: true }
    }

    fn of(segment: &Segment) -> MeshKey {
        let key = segment.key;
        let flat = !key.format.normal && key.smoothing == 0;
        MeshKey { object: key.object, material: key.material, has_uv: key.format.uv, flat }
    }
}

/// Returns the meshes in the order of their first faces, without materials. Triangles that use a vertex twice
/// are left out. The vertices of the others are added to `used`.
pub(super) fn build_meshes(
    mut geometry: ObjGeometry,
    limits: &Limits,
    used: &mut UsedVertices,
) -> Result<Vec<(MeshKey, Mesh)>, LoadError> {
    let mut of_key: HashMap<MeshKey, usize> = HashMap::new();
    let mut members: Vec<(MeshKey, Vec<usize>)> = Vec::new();
    for (i, segment) in geometry.segments.iter().enumerate() {
        let key = MeshKey::of(segment);
        let mesh = *of_key.entry(key).or_insert(members.len());
        if mesh == members.len() {
            LoadError::check_limit("instances", mesh as u64 + 1, limits.instances)?;
            members.push((key, Vec::new()));
        }
        members[mesh].1.push(i);
    }
    let mut vertices = VertexDeduplicator::new(geometry.positions.len());
    LoadError::check_limit("normals", geometry.normals.len() as u64, u64::from(NO_INDEX) - 1)?;
    let normalize = |n: &mut Vec3| {
        *n = normalize_or_zero(*n);
        *n == Vec3::ZERO
    };
    let any_zero_normal =
        geometry.normals.par_iter_mut().with_min_len(1 << 14).map(normalize).reduce(|| false, |a, b| a | b);
    let mut vertex_count = 0;
    let mut out = Vec::with_capacity(members.len());
    for (key, segments) in members {
        vertices.clear();
        let segments = segments.iter().map(|&i| &geometry.segments[i]);
        let mesh = weld(&geometry, key, segments, any_zero_normal, &mut vertices);
        used.add(vertices.keys().iter().map(|key| key.v));
        vertex_count += mesh.positions.len() as u64;
        LoadError::check_limit("vertices", vertex_count, limits.vertices)?;
        out.push((key, mesh));
    }
    Ok(out)
}

/// Normalizes a vector. Returns zero if it has no direction.
fn normalize_or_zero(n: Vec3) -> Vec3 {
    let unit = n.normalize_or_zero();
    // The squared length of a short vector underflows in f32.
    if unit == Vec3::ZERO { n.as_dvec3().normalize_or_zero().as_vec3() } else { unit }
}

/// Welds corners with the same position, texture coordinate and normal into one vertex. A corner whose normal
/// is zero gets the triangle's normal and a vertex of its own.
fn weld<'g>(
    geometry: &'g ObjGeometry,
    key: MeshKey,
    segments: impl Iterator<Item = &'g Segment> + Clone,
    any_zero_normal: bool,
    vertices: &mut VertexDeduplicator,
) -> Mesh {
    let mut mesh = Mesh { name: geometry.objects[key.object as usize].clone(), ..Default::default() };
    let parts = segments.map(|segment| (segment.chunk, segment.range.clone()));
    let welded = Welder::new(geometry, any_zero_normal).weld(parts, vertices);
    (mesh.triangles, mesh.polygons) = (welded.triangles, welded.polygons);
    let keys = vertices.keys().par_iter().with_min_len(1 << 14);
    mesh.positions = keys.clone().map(|k| geometry.positions[k.v as usize]).collect();
    if key.has_uv {
        // v runs up in OBJ and down in the scene.
        let uv = |[u, v]: [f32; 2]| Vec2::new(u, 1.0 - v);
        mesh.uvs.push(keys.clone().map(|k| uv(geometry.uvs[k.a as usize])).collect());
    }
    if !key.flat {
        mesh.normals = keys.clone().map(|k| geometry.normals[k.b as usize]).collect();
        welded.face_normals.into_iter().for_each(|(vertex, n)| mesh.normals[vertex as usize] = n);
    }
    if !geometry.colors.is_empty() {
        mesh.colors = keys.map(|k| geometry.colors[k.v as usize]).collect();
    }
    mesh
}
