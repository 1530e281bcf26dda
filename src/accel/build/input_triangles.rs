//! Filters the input of a BVH build: rejects triangles that are not finite or have no area, and counts them.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use glam::Vec3;
use rayon::prelude::*;

use crate::bvh::build_triangle::BuildTriangle;
use crate::bvh::canonical_triangle::{CanonicalTriangle, Degeneracy};
use crate::bvh::surface_flags::SurfaceFlags;
use crate::report::BuildReport;

/// Bits of a triangle's index: it shares 32 bits with the marks of leaf entries.
pub(crate) const INDEX_BITS: u32 = 30;

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

/// Returns the triangles of `input(0..count)` that can be hit, and how many it rejected. Ignores those beyond
/// [`MAX_TRIANGLES`].
pub(crate) fn filter_triangles(
    count: usize,
    input: impl Fn(usize) -> InputTriangle + Sync,
) -> (Vec<BuildTriangle>, BuildReport) {
    let rejects = RejectCounter::default();
    let reference = |i: usize| match input(i).canonical() {
        Ok((triangle, flags)) => BuildTriangle { triangle, flags, index: i as u32 },
        Err(degeneracy) => {
            rejects.count(degeneracy);
            BuildTriangle::REJECTED
        }
    };
    let mut triangles: Vec<BuildTriangle> = par_indices(count).map(reference).collect();
    let report = rejects.into_report();
    if report != BuildReport::default() {
        triangles.retain(|triangle| triangle.index != BuildTriangle::REJECTED.index);
    }
    (triangles, report)
}

/// Counts the triangles that [`filter_triangles`] would reject.
pub(crate) fn count_rejected(count: usize, input: impl Fn(usize) -> InputTriangle + Sync) -> BuildReport {
    let rejects = RejectCounter::default();
    par_indices(count)
        .filter_map(|i| input(i).canonical().err())
        .for_each(|degeneracy| rejects.count(degeneracy));
    rejects.into_report()
}
