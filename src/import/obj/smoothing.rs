//! Normals of smoothing groups, from faces as they are in the file: what polygons are cut into is not the
//! surface's affair.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::super::smooth::angle_at;
use super::block::{Block, Corner, NONE};
use super::parsed::Segment;
use super::table::Table;

/// Faces that are looked at together.
const BATCH: usize = 1 << 14;

/// Gives the corners of smoothing groups normals: the mean of the group's faces about the vertex, each
/// weighted by its angle there. `segments` are of faces, and stand in the blocks' order.
pub(super) fn smooth(
    blocks: &mut [Block],
    segments: &[Segment],
    positions: &[Vec3],
    normals: &mut Vec<Vec3>,
) {
    if segments.iter().all(|s| s.key.smoothing == 0) {
        return;
    }
    let base = normals.len() as u64;
    let mut table = Table::new(positions.len());
    let mut sums: Vec<DVec3> = Vec::new();
    // The block that the last segment was in, and where its corners ended there.
    let (mut of, mut start) = (0, 0);
    for segment in segments {
        let Block { corners, arities, .. } = &mut blocks[segment.block];
        start = if segment.block == of { start } else { 0 };
        of = segment.block;
        let arity = |face: usize| arities.get(face).map_or(3, |&a| a as usize);
        for first in segment.range.clone().step_by(BATCH) {
            let batch = first..segment.range.end.min(first + BATCH);
            let begin = start;
            start += batch.clone().map(arity).sum::<usize>();
            if segment.key.smoothing == 0 {
                continue;
            }
            let corners = &mut corners[begin..start];
            let mut faces: Vec<&[Corner]> = Vec::with_capacity(batch.len());
            let mut rest = &corners[..];
            for face in batch {
                let (own, others) = rest.split_at(arity(face));
                faces.push(own);
                rest = others;
            }
            let weighted: Vec<DVec3> = faces
                .par_iter()
                .with_min_len(1 << 10)
                .flat_map_iter(|face| weighted(face, positions))
                .collect();
            // Summed one after the other: the same sums whatever the number of threads.
            for (corner, n) in corners.iter_mut().zip(weighted) {
                let i = table.number(corner.v, segment.key.smoothing, 0);
                match sums.get_mut(i as usize) {
                    Some(sum) => *sum += n,
                    None => sums.push(n),
                }
                corner.vn = (base + u64::from(i)).min(u64::from(NONE)) as u32;
            }
        }
    }
    normals.extend(sums.iter().map(|n| n.normalize_or_zero().as_vec3()));
}

/// A face's normal times its angle at each corner.
fn weighted<'a>(face: &'a [Corner], positions: &'a [Vec3]) -> impl Iterator<Item = DVec3> + 'a {
    let at = |k: usize| positions[face[k % face.len()].v as usize].as_dvec3();
    let origin = at(0);
    // Twice the face's area as a vector: across the mean of what is not flat.
    let area = (1..face.len().max(2) - 1).map(|k| (at(k) - origin).cross(at(k + 1) - origin)).sum::<DVec3>();
    let n = area.try_normalize().unwrap_or(DVec3::ZERO);
    (0..face.len()).map(move |k| n * angle_at(at(k), [at(k + 1), at(k + face.len() - 1)]))
}
