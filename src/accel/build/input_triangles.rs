//! What goes into a tree: triangles that can be hit.
//!
//! Triangles that are not finite or have no area are left out and counted.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use obvhs::Boundable;
use obvhs::aabb::Aabb as ObvhsAabb;
use rayon::prelude::*;

use crate::accel::BuildReport;
use crate::accel::build::canonical_triangle::{CanonicalTriangle, Degeneracy};
use crate::scene::SurfaceClass;

/// What a ray needs to know of a triangle's surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct SurfaceFlags {
    pub class: SurfaceClass,
    pub single_sided: bool,
    /// True where the front is seen by rays that run along the corners' normal.
    pub reversed: bool,
}

/// A triangle to be cleaned. `look.reversed` says that the corners' winding is that of the back.
#[derive(Clone, Copy)]
pub(crate) struct InputTriangle {
    pub v: [glam::Vec3; 3],
    pub look: SurfaceFlags,
}

impl InputTriangle {
    /// Its corners in the order of the hit test, and how it looks with them.
    pub fn sorted(self) -> Result<(CanonicalTriangle, SurfaceFlags), Degeneracy> {
        let (corners, turned) = CanonicalTriangle::new(self.v)?;
        Ok((corners, SurfaceFlags { reversed: self.look.reversed ^ turned, ..self.look }))
    }
}

/// A triangle that can be hit.
#[derive(Clone, Copy)]
pub(crate) struct TriangleRef {
    pub corners: CanonicalTriangle,
    pub look: SurfaceFlags,
    /// Its index.
    pub id: u32,
}

impl TriangleRef {
    /// What is nowhere.
    pub const NOWHERE: TriangleRef = TriangleRef {
        corners: CanonicalTriangle::NOWHERE,
        look: SurfaceFlags { class: SurfaceClass::Opaque, single_sided: false, reversed: false },
        id: UNFIT,
    };
}

impl Boundable for TriangleRef {
    fn aabb(&self) -> ObvhsAabb {
        self.corners.bounds().into()
    }
}

/// Most triangles that a tree can hold: their indices share 32 bits with two marks.
pub(crate) const MOST: usize = (1 << 30) - 1;

/// Marks a triangle that cannot be hit.
const UNFIT: u32 = u32::MAX;

/// What cannot be hit, by why.
#[derive(Default)]
struct Unfits {
    non_finite: AtomicU64,
    zero_area: AtomicU64,
}

impl Unfits {
    fn count(&self, unfit: Degeneracy) {
        let counter = if unfit == Degeneracy::NonFinite { &self.non_finite } else { &self.zero_area };
        counter.fetch_add(1, Relaxed);
    }

    fn report(self) -> BuildReport {
        let Unfits { non_finite, zero_area } = self;
        BuildReport {
            non_finite: non_finite.into_inner(),
            zero_area: zero_area.into_inner(),
            ..BuildReport::default()
        }
    }
}

/// The numbers of `raw(0..count)`, up to [`MOST`], in order and by all threads.
fn numbers(count: usize) -> impl IndexedParallelIterator<Item = usize> {
    (0..count.min(MOST)).into_par_iter().with_min_len(1 << 12)
}

/// Those of `raw(0..count)` that can be hit. Those beyond [`MOST`] are left out.
pub(crate) fn clean(
    count: usize,
    raw: impl Fn(usize) -> InputTriangle + Sync,
) -> (Vec<TriangleRef>, BuildReport) {
    let unfits = Unfits::default();
    let one = |i: usize| match raw(i).sorted() {
        Ok((corners, look)) => TriangleRef { corners, look, id: i as u32 },
        Err(unfit) => {
            unfits.count(unfit);
            TriangleRef::NOWHERE
        }
    };
    let mut fit: Vec<TriangleRef> = numbers(count).map(one).collect();
    let report = unfits.report();
    if report != BuildReport::default() {
        fit.retain(|fit| fit.id != UNFIT);
    }
    (fit, report)
}

/// What [`clean`] would leave out.
pub(crate) fn left_out(count: usize, raw: impl Fn(usize) -> InputTriangle + Sync) -> BuildReport {
    let unfits = Unfits::default();
    numbers(count).filter_map(|i| raw(i).sorted().err()).for_each(|unfit| unfits.count(unfit));
    unfits.report()
}
