//! Groups of corners around a vertex that share a tangent: triangles connected by edges, with one orientation.

use blinn_scene::Mesh;
use glam::Vec4;

use super::average::{Member, common_tangent, split_group};
use super::edges::NONE;
use super::frames::{Frame, Mapping, Orientation};

/// Tangents, and for each corner of a mesh the index of its tangent, or [`NONE`].
pub(super) struct CornerTangents {
    pub tangents: Vec<Vec4>,
    pub corners: Vec<u32>,
}

/// Groups the corners of triangles and computes a tangent for each group, or several where tangents are opposed.
///
/// `twins` connects half-edges, so that the corners around a vertex form a path or a ring. A group is the part of it
/// around a corner without a group in which orientations agree. Triangles without a frame take the orientation of the
/// first group that they join.
pub(super) fn group_tangents(
    mesh: &Mesh,
    twins: &[u32],
    frames: &[Frame],
    mut mappings: Vec<Mapping>,
) -> CornerTangents {
    let mut out = CornerTangents { tangents: Vec::new(), corners: vec![NONE; twins.len()] };
    let mut group: Vec<u32> = Vec::new();
    let mut members: Vec<Member> = Vec::new();
    for first in 0..twins.len() as u32 {
        let mapping = mappings[first as usize / 3];
        let Some(orientation) = mapping.orientation.filter(|_| mapping.has_frame) else { continue };
        if out.corners[first as usize] != NONE {
            continue;
        }
        let id = out.tangents.len() as u32;
        let mut joins = |corner: u32| {
            let assigned = &mut out.corners[corner as usize];
            let joined = mappings[corner as usize / 3].orientation.get_or_insert(orientation);
            let joins = *assigned == NONE && *joined == orientation;
            if joins {
                *assigned = id;
            }
            joins
        };
        group.clear();
        joins(first);
        group.push(first);
        for step in [before, after] {
            let mut corner = step(twins, first);
            while corner != NONE && joins(corner) {
                group.push(corner);
                corner = step(twins, corner);
            }
        }
        group.sort_unstable();
        members.clear();
        members.extend(group.iter().map(|&corner| match &mappings[corner as usize / 3] {
            Mapping { has_frame: true, .. } => Member::new(mesh, corner, &frames[corner as usize / 3]),
            _ => Member::without_frame(corner),
        }));
        let sign = if orientation == Orientation::Preserved { 1.0 } else { -1.0 };
        if let Some(tangent) = common_tangent(&members) {
            out.tangents.push(tangent.extend(sign));
            continue;
        }
        for subgroup in split_group(&members) {
            let id = out.tangents.len() as u32;
            out.tangents.push(subgroup.tangent.extend(sign));
            subgroup.corners.iter().for_each(|&corner| out.corners[corner as usize] = id);
        }
    }
    out
}

/// Returns the corner at the same vertex across the half-edge that ends there.
fn before(twins: &[u32], corner: u32) -> u32 {
    twins[previous(corner) as usize]
}

/// Returns the corner at the same vertex across the half-edge that starts there.
fn after(twins: &[u32], corner: u32) -> u32 {
    match twins[corner as usize] {
        NONE => NONE,
        twin => next(twin),
    }
}

/// The next corner of a triangle.
fn next(corner: u32) -> u32 {
    if corner % 3 == 2 { corner - 2 } else { corner + 1 }
}

/// The previous corner of a triangle.
fn previous(corner: u32) -> u32 {
    if corner.is_multiple_of(3) { corner + 2 } else { corner - 1 }
}
