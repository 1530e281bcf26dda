//! Ray queries: closest hit, and any hit (occlusion) with optional transmittance.

use std::ops::ControlFlow;

use glam::Vec3;

use crate::bvh::surface_flags::SurfaceFlags;
use crate::bvh::triangle_ids::TriangleIdMap;
use crate::bvh::triangle4::Triangle4;
use crate::ray_batch::HitFilter;
use crate::traverse::translucent_hits::Transmittance;
use blinn_core::geometry::{Hit, HitId};
use blinn_scene::SurfaceClass;

/// Coincident triangles with equal surface flags, by ascending id.
#[derive(Clone, Copy)]
pub(crate) struct CoincidentIds<'a> {
    /// Indices of triangles in the BVH.
    pub indices: &'a [u32],
    pub id_map: &'a TriangleIdMap,
    /// The instance that was hit, where the BVH is that of an instanced mesh.
    pub instance: Option<u32>,
}

impl CoincidentIds<'_> {
    fn id(&self, index: u32) -> HitId {
        let id = self.id_map.id(index);
        HitId { instance: self.instance.unwrap_or(id.instance), ..id }
    }

    fn iter(&self) -> impl Iterator<Item = HitId> {
        self.indices.iter().map(|&index| self.id(index))
    }

    /// Returns those greater than `id`.
    fn after(&self, id: HitId) -> Self {
        let first = self.indices.partition_point(|&index| self.id(index) <= id);
        CoincidentIds { indices: &self.indices[first..], ..*self }
    }
}

/// A ray query. Traversal reports every triangle that the ray hits between [`RayQuery::t_min`] and
/// [`RayQuery::t_max`], in any order, and perhaps some beyond.
pub(crate) trait RayQuery {
    /// True for any-hit queries: the first hit that ends the query is the whole answer.
    const ANY_HIT: bool;

    /// Hits beyond this t have no effect.
    fn t_max(&self) -> f32;

    /// Hits before this t have no effect.
    fn t_min(&self) -> f32;

    /// The triangle that the ray starts on, whose hits have no effect; [`HitId::NONE`] without one.
    fn source(&self) -> HitId;

    /// An opaque hit before this t ends the query, whichever triangle it is.
    fn early_exit_t_max(&self) -> Option<f32>;

    /// Reports that the ray certainly hits an unfiltered triangle ([`Triangle4::unfiltered_mask`]) before
    /// [`RayQuery::early_exit_t_max`]. Returns true if that ends the query.
    fn early_exit(&mut self, block: &Triangle4, lane: usize, ids: CoincidentIds<'_>) -> bool;

    /// Reports that the ray hits the triangles `ids` at `t`, on their back face if `back` is true. Breaks if that ends
    /// the query.
    fn record_hit(
        &mut self,
        t: f32,
        flags: SurfaceFlags,
        back: bool,
        ids: CoincidentIds<'_>,
    ) -> ControlFlow<()>;
}

/// A ray in world space and the hit filter of its batch.
#[derive(Clone, Copy)]
pub(crate) struct FilteredRay<'a> {
    pub o: Vec3,
    pub d: Vec3,
    pub filter: &'a dyn HitFilter,
}

impl FilteredRay<'_> {
    fn accepts(&self, id: HitId) -> bool {
        self.filter.accepts(id, self.o, self.d)
    }
}

/// The closest-hit query: the first hit after `after` in the order of (t, id).
pub(crate) struct ClosestHit<'a> {
    pub ray: FilteredRay<'a>,
    pub cull_back_faces: bool,
    /// The triangle that the ray starts on, which it does not hit.
    pub source: HitId,
    pub after: Hit,
    /// The closest hit so far; before the first one, the t beyond which nothing counts, and no id.
    pub best: Hit,
}

impl RayQuery for ClosestHit<'_> {
    const ANY_HIT: bool = false;

    #[inline(always)]
    fn source(&self) -> HitId {
        self.source
    }

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.best.t
    }

    #[inline(always)]
    fn t_min(&self) -> f32 {
        self.after.t
    }

    #[inline(always)]
    fn early_exit_t_max(&self) -> Option<f32> {
        None
    }

    #[inline(always)]
    fn early_exit(&mut self, _: &Triangle4, _: usize, _: CoincidentIds<'_>) -> bool {
        false
    }

    #[inline(always)]
    fn record_hit(
        &mut self,
        t: f32,
        flags: SurfaceFlags,
        back: bool,
        ids: CoincidentIds<'_>,
    ) -> ControlFlow<()> {
        let culled = self.cull_back_faces && back && flags.single_sided;
        if culled || t > self.best.t || t < self.after.t {
            return ControlFlow::Continue(());
        }
        let ids = if t == self.after.t { ids.after(self.after.id) } else { ids };
        for id in ids.iter().filter(|&id| id != self.source) {
            let hit = Hit { t, id };
            if !hit.before(&self.best) {
                break;
            }
            if flags.class != SurfaceClass::Cutout || self.ray.accepts(id) {
                self.best = hit;
                break;
            }
        }
        ControlFlow::Continue(())
    }
}

/// The any-hit query: is a shadow ray occluded? If there is a `transmittance`, translucent surfaces are collected there, and
/// the ray counts as occluded once they let no light through.
pub(crate) struct AnyHit<'a, 't> {
    pub ray: FilteredRay<'a>,
    /// From the surface point to the light, along which t grows; `ray` may run the other way.
    pub to_light: Vec3,
    /// The shadow ray ends before this t.
    pub t_max: f32,
    /// The triangle that the shadow ray starts on, which does not occlude it.
    pub source: HitId,
    pub occluded: bool,
    pub transmittance: Option<&'t mut Transmittance>,
}

impl RayQuery for AnyHit<'_, '_> {
    const ANY_HIT: bool = true;

    #[inline(always)]
    fn source(&self) -> HitId {
        self.source
    }

    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn t_min(&self) -> f32 {
        0.0
    }

    #[inline(always)]
    fn early_exit_t_max(&self) -> Option<f32> {
        Some(self.t_max)
    }

    #[inline(always)]
    fn early_exit(&mut self, block: &Triangle4, lane: usize, ids: CoincidentIds<'_>) -> bool {
        self.occluded = block.opaque_mask() >> lane & 1 == 1 && ids.iter().all(|id| id != self.source);
        self.occluded
    }

    #[inline(always)]
    fn record_hit(
        &mut self,
        t: f32,
        flags: SurfaceFlags,
        _: bool,
        ids: CoincidentIds<'_>,
    ) -> ControlFlow<()> {
        if t >= self.t_max {
            return ControlFlow::Continue(());
        }
        let ray = self.ray;
        let source = self.source;
        let mut occluders = ids.iter().filter(|&id| id != source);
        self.occluded = match (flags.class, &mut self.transmittance) {
            (SurfaceClass::Opaque, _) => occluders.next().is_some(),
            (SurfaceClass::Cutout, _) => occluders.any(|id| ray.accepts(id)),
            (SurfaceClass::Translucent, None) => false,
            (SurfaceClass::Translucent, Some(transmittance)) => occluders.any(|id| {
                let FilteredRay { o, d, filter } = ray;
                let absorption_step = filter.absorption_step(id, self.to_light);
                transmittance.attenuate(Hit { t, id }, filter.transmittance(id, o, d), absorption_step)
            }),
        };
        if self.occluded { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
