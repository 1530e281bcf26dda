//! Points and lines, traced as spheres and capsules (Embree: sphere points and round linear curves) in BVHs of their own.
//!
//! The primitives of all instances are kept in world space, points and line segments apart. Their radii are not part of
//! the BVHs: they belong to the rays, because a size in pixels grows with the distance from the eye. Shadow rays and
//! secondary rays see only sizes in metres ([`Rounds::set_solid`]).
//!
//! Rays that follow each other in a batch are traced in packets of sixteen, while they stay together (`packet.rs`).

mod box_test;
mod items;
mod leaf_test;
mod packet;
mod round_bvh;
mod size;
#[cfg(test)]
mod tests;
mod traverse;

pub use size::{RoundSize, RoundSizes};

use crate::ray_batch::{Coherence, HitBatch, HitFilter, RayBatch, ShadowRayBatch};
use crate::traverse::traversal_stats::TraversalStats;
use blinn_core::cancellation::{CancelToken, Cancelled};
use blinn_core::geometry::{Hit, HitId};
use blinn_core::simd::SimdLevel;
use blinn_scene::{AlphaMode, PosedScene};
use items::{PointItem, SegmentItem};
use round_bvh::RoundBvh;
use traverse::{IntersectRounds, RoundQuery};

/// The points and lines of a posed scene.
#[derive(Debug)]
pub(crate) struct Rounds {
    points: RoundBvh<PointItem>,
    lines: RoundBvh<SegmentItem>,
    ids: InstanceIds,
    point_spacing: Option<f32>,
    /// Number of points and lines that are left out: a vertex is not finite, or too far away.
    non_finite: u64,
    /// The sizes for rays without sizes of their own.
    solid: RoundSizes,
}

/// The instances with points or lines, by the numbers of their primitives.
#[derive(Debug, Default)]
pub(crate) struct InstanceIds(Vec<InstanceRange>);

#[derive(Debug)]
struct InstanceRange {
    /// Number of the first primitive.
    first: u32,
    instance: u32,
    alpha_mode: AlphaMode,
}

impl InstanceIds {
    /// Returns the instance and the index in its mesh of a primitive, and its alpha mode.
    fn hit_id(&self, primitive: u32) -> (HitId, AlphaMode) {
        let after = self.0.partition_point(|range| range.first <= primitive);
        match after.checked_sub(1).map(|i| &self.0[i]) {
            Some(range) => {
                let id = HitId { instance: range.instance, triangle: primitive - range.first };
                (id, range.alpha_mode)
            }
            None => (HitId::NONE, AlphaMode::Opaque),
        }
    }
}

impl InstanceIds {
    /// Returns true if nothing is seen of one of two primitives that lie in the same place, whichever comes first: they belong to
    /// the same opaque instance.
    fn are_interchangeable(&self, a: u32, b: u32) -> bool {
        let [(a, alpha_mode), (b, _)] = [a, b].map(|id| self.hit_id(id));
        a.instance == b.instance && alpha_mode == AlphaMode::Opaque
    }
}

impl Rounds {
    /// Builds the BVHs; `None` if nothing visible has points or lines.
    pub fn build(posed: &PosedScene, cancel: &CancelToken) -> Result<Option<Rounds>, Cancelled> {
        let has_rounds = |i: &u32| posed.instances[*i as usize].visible && posed.mesh(*i).has_rounds();
        let instances: Vec<u32> = (0..posed.instances.len() as u32).filter(has_rounds).collect();
        if instances.is_empty() {
            return Ok(None);
        }
        let count = |count: &dyn Fn(u32) -> usize| instances.iter().map(|&i| count(i)).sum();
        let mut points = Vec::with_capacity(count(&|i| posed.mesh(i).point_count()));
        let mut lines = Vec::with_capacity(count(&|i| posed.mesh(i).lines().len()));
        let mut ids = InstanceIds::default();
        let mut next = 0u32;
        for instance in instances {
            let mesh = posed.mesh(instance);
            let primitives = mesh.point_count() + mesh.lines().len();
            // More have no numbers, and do not fit in memory.
            let Some(end) = u32::try_from(primitives).ok().and_then(|n| next.checked_add(n)) else { break };
            let alpha_mode = posed.materials[mesh.material as usize].alpha_mode;
            ids.0.push(InstanceRange { first: next, instance, alpha_mode });
            cancel.check()?;
            let transform = &posed.instances[instance as usize].transform;
            let positions = posed.positions(instance);
            let world = |vertex: u32| transform.point(positions[vertex as usize]);
            let of_points = (0..mesh.point_count() as u32).map(|v| PointItem { p: world(v), id: next + v });
            points.extend(of_points.filter(PointItem::is_drawn));
            let of_lines = mesh.lines().iter().zip(next..);
            let of_lines = of_lines.map(|(&[a, b], id)| SegmentItem { a: world(a), b: world(b), id });
            lines.extend(of_lines.filter(SegmentItem::is_drawn));
            next = end;
        }
        let non_finite = u64::from(next) - (points.len() + lines.len()) as u64;
        let same = |a: u32, b: u32| ids.are_interchangeable(a, b);
        let (points, lines) = rayon::join(
            || RoundBvh::build(points, |a, b| same(a.id, b.id)),
            || RoundBvh::build(lines, |a, b| same(a.id, b.id)),
        );
        cancel.check()?;
        let point_spacing = items::spacing(points.items());
        Ok(Some(Rounds { points, lines, ids, point_spacing, non_finite, solid: RoundSizes::NONE }))
    }

    /// Sets the sizes for rays without sizes of their own: shadow rays and secondary rays.
    pub fn set_solid(&mut self, sizes: RoundSizes) {
        self.solid = sizes;
    }

    /// Replaces hits by those of points and lines that come first.
    pub fn intersect(&self, simd: SimdLevel, rays: &RayBatch, filter: &dyn HitFilter, hits: &mut HitBatch) {
        self.find(simd, rays, RoundQuery::Closest, filter, hits, None);
    }

    /// Finds for each ray if it hits a point or a line.
    pub fn hit_any(&self, simd: SimdLevel, rays: &RayBatch, filter: &dyn HitFilter) -> Vec<bool> {
        let mut hits = vec![Hit::MISS; rays.len()];
        self.find(simd, rays, RoundQuery::Any, filter, &mut hits, None);
        hits.iter().map(|hit| !hit.is_miss()).collect()
    }

    /// Replaces hits as [`Rounds::intersect`] does, and adds what each ray visits to its statistics.
    pub fn intersect_with_stats(
        &self,
        simd: SimdLevel,
        rays: &RayBatch,
        filter: &dyn HitFilter,
        hits: &mut HitBatch,
        stats: &mut [TraversalStats],
    ) {
        self.find(simd, rays, RoundQuery::Closest, filter, hits, Some(stats));
    }

    /// Calls `occlude` with each shadow ray that a point or a line blocks. Blended ones block none.
    pub fn occlude(
        &self,
        simd: SimdLevel,
        shadow_rays: &ShadowRayBatch,
        filter: &dyn HitFilter,
        mut occlude: impl FnMut(usize),
    ) {
        if self.sizes(shadow_rays.rounds) == RoundSizes::NONE {
            return;
        }
        let to = |i: usize| match shadow_rays.coherence {
            Coherence::Direction(direction) => direction,
            Coherence::Origin(_) | Coherence::None => shadow_rays.to[i] - shadow_rays.from[i],
        };
        let t_max =
            if matches!(shadow_rays.coherence, Coherence::Direction(_)) { f32::INFINITY } else { 1.0 };
        let rays = RayBatch {
            origins: shadow_rays.from.clone(),
            directions: (0..shadow_rays.len()).map(to).collect(),
            source: shadow_rays.source.clone(),
            t_max,
            rounds: shadow_rays.rounds,
            ..RayBatch::default()
        };
        let mut hits = vec![Hit::MISS; rays.len()];
        self.find(simd, &rays, RoundQuery::Occluder, filter, &mut hits, None);
        hits.iter().enumerate().filter(|(_, hit)| !hit.is_miss()).for_each(|(i, _)| occlude(i));
    }

    /// Returns the sizes for rays that bring `own`.
    fn sizes(&self, own: RoundSizes) -> RoundSizes {
        if own == RoundSizes::NONE { self.solid } else { own }
    }

    /// Replaces hits by those of points and lines that come first, or by any that a query is satisfied with.
    fn find(
        &self,
        simd: SimdLevel,
        rays: &RayBatch,
        query: RoundQuery,
        filter: &dyn HitFilter,
        hits: &mut HitBatch,
        mut stats: Option<&mut [TraversalStats]>,
    ) {
        let ids = &self.ids;
        let RoundSizes { points, lines } = self.sizes(rays.rounds);
        if points.is_drawn() && !self.points.is_empty() {
            simd.run(IntersectRounds {
                bvh: &self.points,
                ids,
                size: points,
                query,
                rays,
                filter,
                hits: &mut *hits,
                stats: stats.as_deref_mut(),
            });
        }
        if lines.is_drawn() && !self.lines.is_empty() {
            let size = lines;
            simd.run(IntersectRounds { bvh: &self.lines, ids, size, query, rays, filter, hits, stats });
        }
    }

    /// Returns the typical distance from a point to its fourth-nearest neighbour; `None` unless there are five points.
    pub fn point_spacing(&self) -> Option<f32> {
        self.point_spacing
    }

    /// Returns the number of points and of lines.
    pub fn counts(&self) -> [usize; 2] {
        [self.points.items().len(), self.lines.items().len()]
    }

    /// Counts the points and lines that a build would leave out, without building.
    pub fn count_non_finite(posed: &PosedScene) -> u64 {
        let of_instance = |i: u32| {
            let (mesh, positions) = (posed.mesh(i), posed.positions(i));
            let transform = &posed.instances[i as usize].transform;
            let world = |vertex: u32| transform.point(positions[vertex as usize]);
            let points = (0..mesh.point_count() as u32).map(|v| PointItem { p: world(v), id: v });
            let lines = mesh.lines().iter().map(|&[a, b]| SegmentItem { a: world(a), b: world(b), id: a });
            points.filter(|point| !point.is_drawn()).count() + lines.filter(|line| !line.is_drawn()).count()
        };
        let is_shown = |i: &u32| posed.instances[*i as usize].visible && posed.mesh(*i).has_rounds();
        (0..posed.instances.len() as u32).filter(is_shown).map(|i| of_instance(i) as u64).sum()
    }

    /// Returns the number of points and lines that are left out, because a vertex is not finite or too far away.
    pub fn non_finite(&self) -> u64 {
        self.non_finite
    }

    /// Returns the size in bytes.
    pub fn bytes(&self) -> usize {
        self.points.bytes() + self.lines.bytes()
    }
}
