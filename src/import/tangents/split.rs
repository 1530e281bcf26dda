//! Stores tangents of corners at vertices, and splits vertices that have several.

use std::collections::HashMap;

use blinn_scene::{Influences, Mesh, MorphTarget};
use glam::Vec3;

use super::edges::NONE;
use super::groups::CornerTangents;

/// Stores each corner's tangent at its vertex, and splits vertices with several tangents.
pub(super) fn split_vertices(mesh: &mut Mesh, corner_tangents: &CornerTangents) {
    let CornerTangents { tangents, corners } = corner_tangents;
    let vertices = mesh.positions.len();
    // Index of the tangent of each vertex, then of each appended vertex.
    let mut own = vec![NONE; vertices];
    let mut copies: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    // The originals of the appended vertices, in order.
    let mut copied: Vec<u32> = Vec::new();
    for (corner, &tangent) in mesh.triangles.as_flattened_mut().iter_mut().zip(corners) {
        let first = &mut own[*corner as usize];
        if tangent == NONE || *first == tangent {
            continue;
        }
        if *first == NONE {
            *first = tangent;
            continue;
        }
        let value = tangents[tangent as usize];
        if tangents[*first as usize] == value {
            continue;
        }
        let vertex = *corner;
        *corner = *copies.entry((vertex, value.to_array().map(f32::to_bits))).or_insert_with(|| {
            copied.push(vertex);
            own.push(tangent);
            (own.len() - 1) as u32
        });
    }
    append_copies(mesh, &copied);
    // Vertices without a tangent use any frame around their normal.
    let stored = |(&tangent, normal): (&u32, &Vec3)| match tangents.get(tangent as usize) {
        Some(&tangent) => tangent,
        None => normal.any_orthonormal_vector().extend(1.0),
    };
    mesh.tangents = own.iter().zip(&mesh.normals).map(stored).collect();
}

/// Appends copies of vertices with all their attributes.
pub(crate) fn append_copies(mesh: &mut Mesh, copied: &[u32]) {
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
