//! What goes into a tree: triangles that can be hit.
//!
//! Triangles that are not finite or have no area are left out and counted.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use obvhs::Boundable;
use obvhs::aabb::Aabb;
use rayon::prelude::*;

use crate::accel::CleanReport;
use crate::accel::build::canonical_triangle::{Corners, Unfit};
use crate::accel::bvh::bvh8::aabb;
use crate::scene::SurfaceClass;

/// What a ray needs to know of a triangle's surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Look {
    pub class: SurfaceClass,
    pub single_sided: bool,
    /// True where the front is seen by rays that run along the corners' normal.
    pub reversed: bool,
}

/// A triangle to be cleaned. `look.reversed` says that the corners' winding is that of the back.
#[derive(Clone, Copy)]
pub(crate) struct Raw {
    pub v: [glam::Vec3; 3],
    pub look: Look,
}

impl Raw {
    /// Its corners in the order of the hit test, and how it looks with them.
    pub fn sorted(self) -> Result<(Corners, Look), Unfit> {
        let (corners, turned) = Corners::new(self.v)?;
        Ok((corners, Look { reversed: self.look.reversed ^ turned, ..self.look }))
    }
}

/// A triangle that can be hit.
#[derive(Clone, Copy)]
pub(crate) struct Fit {
    pub corners: Corners,
    pub look: Look,
    /// Its index.
    pub id: u32,
}

impl Fit {
    /// What is nowhere.
    pub const NOWHERE: Fit = Fit {
        corners: Corners::NOWHERE,
        look: Look { class: SurfaceClass::Opaque, single_sided: false, reversed: false },
        id: UNFIT,
    };
}

impl Boundable for Fit {
    fn aabb(&self) -> Aabb {
        aabb(self.corners.bounds())
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
    fn count(&self, unfit: Unfit) {
        let counter = if unfit == Unfit::NonFinite { &self.non_finite } else { &self.zero_area };
        counter.fetch_add(1, Relaxed);
    }

    fn report(self) -> CleanReport {
        let Unfits { non_finite, zero_area } = self;
        CleanReport {
            non_finite: non_finite.into_inner(),
            zero_area: zero_area.into_inner(),
            ..CleanReport::default()
        }
    }
}

/// The numbers of `raw(0..count)`, up to [`MOST`], in order and by all threads.
fn numbers(count: usize) -> impl IndexedParallelIterator<Item = usize> {
    (0..count.min(MOST)).into_par_iter().with_min_len(1 << 12)
}

/// Those of `raw(0..count)` that can be hit. Those beyond [`MOST`] are left out.
pub(crate) fn clean(count: usize, raw: impl Fn(usize) -> Raw + Sync) -> (Vec<Fit>, CleanReport) {
    let unfits = Unfits::default();
    let one = |i: usize| match raw(i).sorted() {
        Ok((corners, look)) => Fit { corners, look, id: i as u32 },
        Err(unfit) => {
            unfits.count(unfit);
            Fit::NOWHERE
        }
    };
    let mut fit: Vec<Fit> = numbers(count).map(one).collect();
    let report = unfits.report();
    if report != CleanReport::default() {
        fit.retain(|fit| fit.id != UNFIT);
    }
    (fit, report)
}

/// What [`clean`] would leave out.
pub(crate) fn left_out(count: usize, raw: impl Fn(usize) -> Raw + Sync) -> CleanReport {
    let unfits = Unfits::default();
    numbers(count).filter_map(|i| raw(i).sorted().err()).for_each(|unfit| unfits.count(unfit));
    unfits.report()
}
