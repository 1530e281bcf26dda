//! Vertex normals of smoothing groups. They come from the polygons of the file, so they do not depend on how
//! polygons are triangulated.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::super::smooth::angle_at;
use super::chunk::{Chunk, Corner, NO_INDEX};
use super::segment::Segment;
use crate::polygons::vertex_dedup::VertexDeduplicator;

/// Faces per parallel batch.
const BATCH: usize = 1 << 14;

/// Adds normals to the corners of smoothing groups: the mean of the group's face normals at the vertex,
/// weighted by the angle of each face there. `segments` hold faces, in the order of the chunks.
pub(super) fn add_smooth_normals(
    chunks: &mut [Chunk],
    segments: &[Segment],
    positions: &[Vec3],
    normals: &mut Vec<Vec3>,
) {
    if segments.iter().all(|s| s.key.smoothing == 0) {
        return;
    }
    let base = normals.len() as u64;
    let mut vertices = VertexDeduplicator::new(positions.len());
    let mut sums: Vec<DVec3> = Vec::new();
    // The chunk of the previous segment, and the end of its corners there.
    let mut chunk = 0;
    let mut start = 0;
    for segment in segments {
        let Chunk { corners, arities, .. } = &mut chunks[segment.chunk];
        start = if segment.chunk == chunk { start } else { 0 };
        chunk = segment.chunk;
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
            let normals: Vec<DVec3> = faces
                .par_iter()
                .with_min_len(1 << 10)
                .flat_map_iter(|face| angle_weighted_normals(face, positions))
                .collect();
            // The sums run in file order: they do not depend on the number of threads.
            for (corner, n) in corners.iter_mut().zip(normals) {
                let i = vertices.number_of(corner.v, segment.key.smoothing, 0);
                match sums.get_mut(i as usize) {
                    Some(sum) => *sum += n,
                    None => sums.push(n),
                }
                corner.vn = (base + u64::from(i)).min(u64::from(NO_INDEX)) as u32;
            }
        }
    }
    normals.extend(sums.iter().map(|n| n.normalize_or_zero().as_vec3()));
}

/// Returns the face normal times the face's angle at each corner.
fn angle_weighted_normals<'a>(face: &'a [Corner], positions: &'a [Vec3]) -> impl Iterator<Item = DVec3> + 'a {
    let at = |k: usize| positions[face[k % face.len()].v as usize].as_dvec3();
    let origin = at(0);
    // Twice the vector area of the face: the mean normal if the face is not planar.
    let area = (1..face.len().max(2) - 1).map(|k| (at(k) - origin).cross(at(k + 1) - origin)).sum::<DVec3>();
    let n = area.try_normalize().unwrap_or(DVec3::ZERO);
    (0..face.len()).map(move |k| n * angle_at(at(k), [at(k + 1), at(k + face.len() - 1)]))
}
