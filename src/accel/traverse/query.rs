//! What is asked of a ray: the closest hit, whether anything is in the way, how much light passes.

use std::ops::ControlFlow;

use glam::Vec3;

use crate::accel::build::surface_flags::SurfaceFlags;
use crate::accel::bvh::triangle_ids::TriangleIdMap;
use crate::accel::bvh::triangle4::Triangle4;
use crate::accel::ray_batch::AnyHitFilter;
use crate::accel::traverse::transmittance::Transmittance;
use crate::geometry::{Hit, HitId};
use crate::scene::SurfaceClass;

/// Triangles in one place that look alike, by rising id.
#[derive(Clone, Copy)]
pub(crate) struct CoincidentIds<'a> {
    /// Indices.
    pub ids: &'a [u32],
    /// What they mean.
    pub spans: &'a TriangleIdMap,
    /// The instance, where a shared mesh was met.
    pub instance: Option<u32>,
}

impl CoincidentIds<'_> {
    fn own(&self, index: u32) -> HitId {
        let id = self.spans.id(index);
        HitId { instance: self.instance.unwrap_or(id.instance), ..id }
    }

    /// All of them.
    fn iter(&self) -> impl Iterator<Item = HitId> {
        self.ids.iter().map(|&index| self.own(index))
    }

    /// Those greater than `id`.
    fn after(&self, id: HitId) -> Self {
        let first = self.ids.partition_point(|&index| self.own(index) <= id);
        CoincidentIds { ids: &self.ids[first..], ..*self }
    }
}

/// A question, told of every triangle that a ray meets in any order.
pub(crate) trait RayQuery {
    /// True where any hit that stops it is the whole answer.
    const ANY_HIT: bool;

    /// Nothing beyond this t matters.
    fn t_max(&self) -> f32;

    /// Nothing before this t matters.
    fn t_min(&self) -> f32;

    /// What t has to be less than for any opaque triangle there to be the whole answer.
    fn early_out_t_max(&self) -> Option<f32>;

    /// The ray surely meets a plain triangle before [`RayQuery::early_out_t_max`]. True where that is the answer.
    fn early_out(&mut self, block: &Triangle4, lane: usize, ids: CoincidentIds<'_>) -> bool;

    /// The ray meets the triangles `ids` at `t`. Breaks where the answer is known.
    fn record_hit(
        &mut self,
        t: f32,
        look: SurfaceFlags,
        back: bool,
        ids: CoincidentIds<'_>,
    ) -> ControlFlow<()>;
}

/// A ray as its caller gave it, for cutouts.
#[derive(Clone, Copy)]
pub(crate) struct RayContext<'a> {
    pub o: Vec3,
    pub d: Vec3,
    pub cutouts: &'a dyn AnyHitFilter,
}

/// The first hit after `after` in the order of (t, id).
pub(crate) struct ClosestHit<'a> {
    pub asked: RayContext<'a>,
    pub cull: bool,
    pub after: Hit,
    /// The best so far; before that, the farthest place where a hit counts, and no id.
    pub best: Hit,
}

impl RayQuery for ClosestHit<'_> {
    const ANY_HIT: bool = false;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.best.t
    }

    #[inline(always)]
    fn t_min(&self) -> f32 {
        self.after.t
    }

    #[inline(always)]
    fn early_out_t_max(&self) -> Option<f32> {
        None
    }

    #[inline(always)]
    fn early_out(&mut self, _: &Triangle4, _: usize, _: CoincidentIds<'_>) -> bool {
        false
    }

    #[inline(always)]
    fn record_hit(
        &mut self,
        t: f32,
        look: SurfaceFlags,
        back: bool,
        ids: CoincidentIds<'_>,
    ) -> ControlFlow<()> {
        let seen = !(self.cull && back && look.single_sided);
        if !seen || t > self.best.t || t < self.after.t {
            return ControlFlow::Continue(());
        }
        let ids = if t == self.after.t { ids.after(self.after.id) } else { ids };
        for id in ids.iter() {
            let hit = Hit { t, id };
            if !hit.before(&self.best) {
                break;
            }
            if look.class != SurfaceClass::Cutout
                || self.asked.cutouts.accepts(id, self.asked.o, self.asked.d)
            {
                self.best = hit;
                break;
            }
        }
        ControlFlow::Continue(())
    }
}

/// Whether something blocks a segment; with `passing`, what passes through what does not block it is kept
/// there, and where that is nothing, it is blocked.
pub(crate) struct AnyHit<'a, 'p> {
    pub asked: RayContext<'a>,
    /// The segment ends before this t.
    pub end: f32,
    pub source: HitId,
    pub blocked: bool,
    pub passing: Option<&'p mut Transmittance>,
}

impl RayQuery for AnyHit<'_, '_> {
    const ANY_HIT: bool = true;

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.end
    }

    #[inline(always)]
    fn t_min(&self) -> f32 {
        0.0
    }

    #[inline(always)]
    fn early_out_t_max(&self) -> Option<f32> {
        Some(self.end)
    }

    #[inline(always)]
    fn early_out(&mut self, block: &Triangle4, lane: usize, ids: CoincidentIds<'_>) -> bool {
        self.blocked = block.opaque_mask() >> lane & 1 == 1 && ids.iter().all(|id| id != self.source);
        self.blocked
    }

    #[inline(always)]
    fn record_hit(&mut self, t: f32, look: SurfaceFlags, _: bool, ids: CoincidentIds<'_>) -> ControlFlow<()> {
        if t >= self.end {
            return ControlFlow::Continue(());
        }
        let RayContext { o, d, cutouts } = self.asked;
        let source = self.source;
        let mut others = ids.iter().filter(|&id| id != source);
        self.blocked = match (look.class, &mut self.passing) {
            (SurfaceClass::Opaque, _) => others.next().is_some(),
            (SurfaceClass::Cutout, _) => others.any(|id| cutouts.accepts(id, o, d)),
            (SurfaceClass::Translucent, None) => false,
            (SurfaceClass::Translucent, Some(passing)) => {
                others.any(|id| passing.pass(Hit { t, id }, self.asked))
            }
        };
        if self.blocked { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
