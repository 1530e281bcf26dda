//! Filters the input of a BVH build: rejects triangles that are not finite or have no area, and counts them.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use glam::Vec3;
use rayon::prelude::*;

use crate::build::morton_clusters::{INDEX_BITS, MortonKey};
use crate::bvh::aabb::Aabb;
use crate::bvh::build_triangle::BuildTriangle;
use crate::bvh::canonical_triangle::{CanonicalTriangle, Degeneracy, canonical_bounds};
use crate::bvh::surface_flags::SurfaceFlags;
use crate::report::BuildReport;

/// Maximum number of triangles in a BVH.
pub(crate) const MAX_TRIANGLES: usize = (1 << INDEX_BITS) - 1;

/// A triangle as the scene has it. `flags.reversed` is true where its winding is that of the back face.
#[derive(Clone, Copy)]
pub(crate) struct InputTriangle {
    pub vertices: [Vec3; 3],
    pub flags: SurfaceFlags,
}

impl InputTriangle {
    /// Sorts the vertices, and adjusts the flags to their winding.
    pub fn canonical(self) -> Result<(CanonicalTriangle, SurfaceFlags), Degeneracy> {
        let (triangle, flipped) = CanonicalTriangle::new(self.vertices)?;
        Ok((triangle, SurfaceFlags { reversed: self.flags.reversed ^ flipped, ..self.flags }))
    }
}

/// Counts rejected triangles, on all threads.
#[derive(Default)]
struct RejectCounter {
    non_finite: AtomicU64,
    zero_area: AtomicU64,
}

impl RejectCounter {
    fn count(&self, degeneracy: Degeneracy) {
        let counter = match degeneracy {
            Degeneracy::NonFinite => &self.non_finite,
            Degeneracy::ZeroArea => &self.zero_area,
        };
        counter.fetch_add(1, Relaxed);
    }

    fn into_report(self) -> BuildReport {
        BuildReport {
            non_finite: self.non_finite.into_inner(),
            zero_area: self.zero_area.into_inner(),
            ..BuildReport::default()
        }
    }
}

/// The indices of `count` triangles, up to [`MAX_TRIANGLES`], for all threads.
pub(crate) fn par_indices(count: usize) -> impl IndexedParallelIterator<Item = usize> {
    (0..count.min(MAX_TRIANGLES)).into_par_iter().with_min_len(1 << 12)
}

/// Builds of up to this many triangles store them. Larger ones compute a triangle again where they use it, which takes 48 bytes
/// less for each at the peak and reads fewer bytes than stored ones have.
pub const MAX_STORED_TRIANGLES: u64 = 1 << 21;

/// The triangles of a build, by their index in the input.
pub(crate) struct BuildTriangles<I> {
    input: I,
    /// The triangles, if they are stored; [`BuildTriangle::REJECTED`] where one is rejected.
    stored: Vec<BuildTriangle>,
}

impl<I: Fn(usize) -> InputTriangle + Sync> BuildTriangles<I> {
    /// Returns the triangles of `input(0..count)`, keys of those that can be hit, and how many are rejected. Ignores those
    /// beyond [`MAX_TRIANGLES`].
    pub fn new(count: usize, input: I) -> (BuildTriangles<I>, Vec<MortonKey>, BuildReport) {
        BuildTriangles::with_max_stored(count, input, MAX_STORED_TRIANGLES as usize)
    }

    fn with_max_stored(
        count: usize,
        input: I,
        max_stored: usize,
    ) -> (BuildTriangles<I>, Vec<MortonKey>, BuildReport) {
        let rejects = RejectCounter::default();
        let is_rejected =
            |i: usize| input(i).canonical().map_err(|degeneracy| rejects.count(degeneracy)).is_err();
        let build_triangle = |i: usize| {
            build_triangle(&input, i).unwrap_or_else(|degeneracy| {
                rejects.count(degeneracy);
                BuildTriangle::REJECTED
            })
        };
        let (stored, rejected): (Vec<BuildTriangle>, Vec<usize>) = if count <= max_stored {
            let stored: Vec<BuildTriangle> = par_indices(count).map(build_triangle).collect();
            (stored, Vec::new())
        } else {
            (Vec::new(), par_indices(count).filter(|&i| is_rejected(i)).collect())
        };
        let report = rejects.into_report();
        let mut keys: Vec<MortonKey> = par_indices(count).map(MortonKey::new).collect();
        if report != BuildReport::default() && !stored.is_empty() {
            keys.retain(|key| stored[key.index()].index != BuildTriangle::REJECTED.index);
        }
        if !rejected.is_empty() {
            let mut rejected = rejected.into_iter().peekable();
            keys.retain(|key| rejected.next_if_eq(&key.index()).is_none());
        }
        (BuildTriangles { input, stored }, keys, report)
    }

    /// Returns the triangle of a key.
    #[inline(always)]
    pub fn get(&self, i: u32) -> BuildTriangle {
        match self.stored.get(i as usize) {
            Some(&stored) => stored,
            // Triangles with a key are not degenerate.
            None => build_triangle(&self.input, i as usize).unwrap_or(BuildTriangle::REJECTED),
        }
    }

    /// Returns the bounds of the triangle of a key.
    #[inline(always)]
    pub fn bounds(&self, i: u32) -> Aabb {
        match self.stored.get(i as usize) {
            Some(stored) => stored.triangle.bounds(),
            None => canonical_bounds((self.input)(i as usize).vertices),
        }
    }
}

#[inline(always)]
fn build_triangle(input: &impl Fn(usize) -> InputTriangle, i: usize) -> Result<BuildTriangle, Degeneracy> {
    let (triangle, flags) = input(i).canonical()?;
    Ok(BuildTriangle { triangle, flags, index: i as u32 })
}

/// Counts the triangles that a build would reject.
pub(crate) fn count_rejected(count: usize, input: impl Fn(usize) -> InputTriangle + Sync) -> BuildReport {
    let rejects = RejectCounter::default();
    par_indices(count)
        .filter_map(|i| input(i).canonical().err())
        .for_each(|degeneracy| rejects.count(degeneracy));
    rejects.into_report()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn computed_triangles_are_the_stored_ones() {
        let vertex =
            |i: usize| Vec3::new((i * 7 % 11) as f32, (i * 5 % 13) as f32 - 6.0, -((i % 3) as f32) * 1e-39);
        let input = |i: usize| InputTriangle {
            vertices: match i % 10 {
                3 => [vertex(i); 3],
                7 => [vertex(i), Vec3::NAN, vertex(i + 2)],
                _ => [vertex(i), vertex(i + 1), vertex(i + 4)],
            },
            flags: SurfaceFlags { single_sided: i.is_multiple_of(4), ..SurfaceFlags::default() },
        };
        let (stored, keys, report) = BuildTriangles::with_max_stored(1000, input, 1000);
        let (computed, same_keys, same_report) = BuildTriangles::with_max_stored(1000, input, 999);
        assert_eq!((stored.stored.len(), computed.stored.len()), (1000, 0));
        assert_eq!(report, same_report);
        assert_eq!((report.non_finite, keys.len() as u64), (100, 900 - report.zero_area));
        assert!(report.zero_area >= 100 && keys == same_keys);
        for i in keys.iter().map(|key| key.index() as u32) {
            let (a, b) = (stored.get(i), computed.get(i));
            assert_eq!((a.triangle.to_bits(), a.flags, a.index), (b.triangle.to_bits(), b.flags, i));
            assert_eq!((a.index, a.triangle.max_edge()), (b.index, b.triangle.max_edge()));
            assert_eq!(stored.bounds(i).to_bits(), computed.bounds(i).to_bits());
        }
    }
}
