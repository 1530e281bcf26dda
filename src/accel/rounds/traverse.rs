//! Traversal of the BVHs of points and lines by single rays.

use glam::Vec3;

use super::InstanceIds;
use super::box_test::BoxTest;
use super::items::Ray64;
use super::leaf_test::LeafItem;
use super::round_bvh::{RoundBvh, WIDTH};
use super::size::RoundSize;
use crate::ray_batch::{HitBatch, HitFilter, RayBatch};
use crate::traverse::traversal_stats::TraversalStats;
use blinn_core::geometry::{Hit, HitId};
use blinn_core::simd::AutovecKernel;
use blinn_scene::AlphaMode;

/// The points or lines that rays search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RoundQuery {
    /// The first one in front of the hit.
    Closest,
    /// Any.
    Any,
    /// Any that is not blended.
    Occluder,
}

/// Finds the points or lines in front of the hits of rays.
pub(super) struct IntersectRounds<'a, T> {
    pub bvh: &'a RoundBvh<T>,
    pub ids: &'a InstanceIds,
    pub size: RoundSize,
    pub query: RoundQuery,
    pub rays: &'a RayBatch,
    pub filter: &'a dyn HitFilter,
    pub hits: &'a mut HitBatch,
    /// Receives the nodes and leaves that each ray visits.
    pub stats: Option<&'a mut [TraversalStats]>,
}

impl<T: LeafItem> AutovecKernel for IntersectRounds<'_, T> {
    #[inline(always)]
    fn run(mut self) {
        let mut stack = Vec::new();
        for i in 0..self.rays.len() {
            let (o, d) = (self.rays.origins[i], self.rays.directions[i]);
            let mut search = Search {
                bvh: self.bvh,
                ids: self.ids,
                size: self.size,
                query: self.query,
                source: self.rays.source(i),
                filter: self.filter,
                o,
                d,
                after: self.rays.after(i),
                t_max: self.rays.t_max,
                hit: self.hits[i],
                visits: TraversalStats::default(),
            };
            search.run(&mut stack);
            self.hits[i] = search.hit;
            if let Some(stats) = &mut self.stats {
                stats[i].add(search.visits);
            }
        }
    }
}

/// A child to visit.
#[derive(Clone, Copy)]
struct Entry {
    /// The level of the node; 0 stands for leaves.
    level: u32,
    index: u32,
    near: f32,
}

/// A ray on its way through a BVH.
struct Search<'a, T> {
    bvh: &'a RoundBvh<T>,
    ids: &'a InstanceIds,
    size: RoundSize,
    query: RoundQuery,
    /// The primitive that the ray starts on, which it does not hit.
    source: HitId,
    filter: &'a dyn HitFilter,
    o: Vec3,
    d: Vec3,
    after: Hit,
    t_max: f32,
    hit: Hit,
    visits: TraversalStats,
}

impl<T: LeafItem> Search<'_, T> {
    #[inline(always)]
    fn run(&mut self, stack: &mut Vec<Entry>) {
        let ray =
            Ray64 { o: self.o.as_dvec3(), d: self.d.as_dvec3(), dd: self.d.as_dvec3().length_squared() };
        if !(ray.dd > 0.0 && ray.dd.is_finite() && ray.o.is_finite()) {
            return;
        }
        let test = BoxTest::new(self.o, self.d, self.size, self.bvh.bounds());
        stack.clear();
        stack.push(Entry { level: self.bvh.level_count() as u32, index: 0, near: 0.0 });
        while let Some(Entry { level, index, near }) = stack.pop() {
            if self.query != RoundQuery::Closest && !self.hit.is_miss() {
                return;
            }
            if near > self.hit.t.min(self.t_max) {
                continue;
            }
            if level == 0 {
                self.leaf(index as usize, &ray, &test);
                continue;
            }
            self.visits.nodes += 1;
            let nears = test.near(self.bvh.node(level as usize - 1, index as usize));
            let limit = self.hit.t.min(self.t_max);
            let mut children = [Entry { level: level - 1, index: 0, near: 0.0 }; WIDTH];
            let mut count = 0;
            for (child, near) in nears.into_iter().enumerate() {
                // False for NaN.
                if near <= limit {
                    // Nearest last.
                    let mut at = count;
                    while at > 0 && children[at - 1].near < near {
                        children[at] = children[at - 1];
                        at -= 1;
                    }
                    let index = index * WIDTH as u32 + child as u32;
                    children[at] = Entry { level: level - 1, index, near };
                    count += 1;
                }
            }
            stack.extend_from_slice(&children[..count]);
        }
    }

    /// Intersects the items of a leaf.
    #[inline(always)]
    fn leaf(&mut self, leaf: usize, ray: &Ray64, test: &BoxTest) {
        let items = self.bvh.leaf(leaf);
        self.visits.blocks += 1;
        self.visits.triangles += items.len() as u32;
        let mut near = T::near(items, test, self.hit.t.min(self.t_max));
        while near != 0 {
            let item = &items[near.trailing_zeros() as usize];
            near &= near - 1;
            let Some(t) = item.enter(ray, &self.size) else { continue };
            let t = t as f32;
            if !(t > 0.0 && t <= self.hit.t && t <= self.t_max && t >= self.after.t) {
                continue;
            }
            let (id, alpha_mode) = self.ids.hit_id(item.id());
            if id == self.source || (self.query == RoundQuery::Occluder && alpha_mode == AlphaMode::Blend) {
                continue;
            }
            let has_mask = matches!(alpha_mode, AlphaMode::Mask(_));
            let hit = Hit { t, id };
            if hit.before(&self.hit)
                && self.after.before(&hit)
                && (!has_mask || self.filter.accepts(id, self.o, self.d))
            {
                self.hit = hit;
            }
        }
    }
}
