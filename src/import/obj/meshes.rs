//! Triangles to meshes: one for each material of each object, with welded vertices and normals.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::super::{Limits, LoadError};
use super::block::{Corner, NONE};
use super::parsed::{Parsed, Segment};
use super::table::Table;
use crate::scene::Mesh;

/// What the triangles of a mesh have in common. Smoothing groups share meshes: a file may have one
/// for each face.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct MeshKey {
    pub object: u32,
    /// Index into [`Parsed::materials`].
    pub material: Option<u32>,
    has_uv: bool,
    flat: bool,
}

impl MeshKey {
    fn of(segment: &Segment) -> MeshKey {
        let key = segment.key;
        let flat = !key.has_normal && key.smoothing == 0;
        MeshKey { object: key.object, material: key.material, has_uv: key.has_uv, flat }
    }
}

/// Meshes in the order of their first faces, without their materials, and without triangles of which two
/// corners are one vertex.
pub(super) fn meshes(mut parsed: Parsed, limits: &Limits) -> Result<Vec<(MeshKey, Mesh)>, LoadError> {
    let mut of_key: HashMap<MeshKey, usize> = HashMap::new();
    let mut members: Vec<(MeshKey, Vec<usize>)> = Vec::new();
    for (i, segment) in parsed.segments.iter().enumerate() {
        let key = MeshKey::of(segment);
        let mesh = *of_key.entry(key).or_insert(members.len());
        if mesh == members.len() {
            LoadError::check_limit("instances", mesh as u64 + 1, limits.instances)?;
            members.push((key, Vec::new()));
        }
        members[mesh].1.push(i);
    }
    let mut table = Table::new(parsed.positions.len());
    LoadError::check_limit("normals", parsed.normals.len() as u64, u64::from(NONE) - 1)?;
    let bad = |n: &mut Vec3| {
        *n = unit(*n);
        *n == Vec3::ZERO
    };
    let any_bad = parsed.normals.par_iter_mut().with_min_len(1 << 14).map(bad).reduce(|| false, |a, b| a | b);
    let mut vertices = 0;
    let mut out = Vec::with_capacity(members.len());
    for (key, segments) in members {
        table.clear();
        let segments = segments.iter().map(|&i| &parsed.segments[i]);
        let mesh = weld(&parsed, key, segments, any_bad, &mut table);
        vertices += mesh.positions.len() as u64;
        LoadError::check_limit("vertices", vertices, limits.vertices)?;
        out.push((key, mesh));
    }
    Ok(out)
}

/// Of length one, or zero where there is no such vector.
fn unit(n: Vec3) -> Vec3 {
    let one = n.normalize_or_zero();
    if one == Vec3::ZERO { n.as_dvec3().normalize_or_zero().as_vec3() } else { one }
}

/// The normal of a triangle, wherever it has one.
fn face_normal(corners: &[Corner; 3], positions: &[Vec3]) -> Option<DVec3> {
    let [a, b, c] = corners.map(|c| positions[c.v as usize].as_dvec3());
    (b - a).cross(c - a).try_normalize()
}

/// Corners that agree in vertex, texture coordinate and normal become one. A corner without a
/// normal of any length gets the triangle's own, and stays alone.
fn weld<'p>(
    parsed: &'p Parsed,
    key: MeshKey,
    segments: impl Iterator<Item = &'p Segment> + Clone,
    any_bad: bool,
    table: &mut Table,
) -> Mesh {
    let mut mesh = Mesh { name: parsed.objects[key.object as usize].clone(), ..Default::default() };
    mesh.triangles.reserve_exact(segments.clone().map(|s| s.range.len()).sum());
    let mut own_normals: Vec<(u32, Vec3)> = Vec::new();
    for t in segments.flat_map(|s| parsed.triangles_of(s)) {
        let [a, b, c] = t;
        // Nothing is missing without it.
        if a.v == b.v || b.v == c.v || c.v == a.v {
            continue;
        }
        mesh.triangles.push(t.map(|c| {
            if any_bad && c.vn != NONE && parsed.normals[c.vn as usize] == Vec3::ZERO {
                let alone = table.alone(c.v, c.vt, c.vn);
                let own = face_normal(t, &parsed.positions).unwrap_or(DVec3::Y);
                own_normals.push((alone, own.as_vec3()));
                return alone;
            }
            table.number(c.v, c.vt, c.vn)
        }));
    }
    let keys = table.keys().par_iter().with_min_len(1 << 14);
    mesh.positions = keys.clone().map(|k| parsed.positions[k.v as usize]).collect();
    if key.has_uv {
        // OBJ's v runs up, the scene's runs down.
        let uv = |[u, v]: [f32; 2]| Vec2::new(u, 1.0 - v);
        mesh.uvs.push(keys.clone().map(|k| uv(parsed.uvs[k.a as usize])).collect());
    }
    if !key.flat {
        mesh.normals = keys.clone().map(|k| parsed.normals[k.b as usize]).collect();
        own_normals.into_iter().for_each(|(vertex, n)| mesh.normals[vertex as usize] = n);
    }
    if !parsed.colors.is_empty() {
        mesh.colors = keys.map(|k| parsed.colors[k.v as usize]).collect();
    }
    mesh
}
