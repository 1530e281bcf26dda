//! Traversal of the BVHs of points and lines by packets and by single rays.

use glam::Vec3;

use super::InstanceIds;
use super::box_test::BoxTest;
use super::items::Ray64;
use super::leaf_test::LeafItem;
use super::packet::{RAYS, RoundPacket};
use super::round_bvh::{RoundBvh, WIDTH};
use super::size::RoundSize;
use crate::ray_batch::{HitBatch, HitFilter, RayBatch};
use crate::traverse::traversal_stats::TraversalStats;
use blinn_core::geometry::Hit;
use blinn_core::simd::{Simd, SimdKernel};
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

/// As many rays of a packet as are worth visiting a node together.
const MIN_PACKET: u32 = 3;

/// Finds the points or lines in front of the hits of rays.
pub(super) struct IntersectRounds<'a, T> {
    pub bvh: &'a RoundBvh<T>,
    pub ids: &'a InstanceIds,
    pub size: RoundSize,
    pub query: RoundQuery,
    pub rays: &'a RayBatch,
    pub filter: &'a dyn HitFilter,
    pub hits: &'a mut HitBatch,
    /// Receives the nodes and leaves that each ray visits, traced alone.
    pub stats: Option<&'a mut [TraversalStats]>,
}

/// A child to visit.
#[derive(Clone, Copy)]
struct Entry {
    /// The level of the node; 0 stands for leaves.
    level: u32,
    index: u32,
    near: f32,
    /// The greatest radius in it, for packets.
    radius: f32,
}

/// The children to visit, of a packet and of a single ray.
#[derive(Default)]
struct Stacks {
    packet: Vec<Entry>,
    single: Vec<Entry>,
}

impl<T: LeafItem> SimdKernel for IntersectRounds<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self) {
        let mut stacks = Stacks::default();
        for first in (0..self.rays.len()).step_by(RAYS) {
            let count = (self.rays.len() - first).min(RAYS);
            match self.packet::<S>(first, count) {
                Some(packet) => self.trace_packet(packet, first, &mut stacks),
                None => {
                    for i in first..first + count {
                        self.trace(i, self.root(), &mut stacks.single);
                    }
                }
            }
        }
    }
}

impl<T: LeafItem> IntersectRounds<'_, T> {
    #[inline(always)]
    fn root(&self) -> Entry {
        Entry { level: self.bvh.level_count() as u32, index: 0, near: 0.0, radius: 0.0 }
    }

    #[inline(always)]
    fn ray(&self, i: usize) -> Ray64 {
        let d = self.rays.directions[i].as_dvec3();
        Ray64 { o: self.rays.origins[i].as_dvec3(), d, dd: d.length_squared() }
    }

    /// Returns the greatest t at which a hit of a ray has an effect; −1 for a ray whose search has ended.
    #[inline(always)]
    fn limit(&self, hit: &Hit) -> f32 {
        if self.query != RoundQuery::Closest && !hit.is_miss() { -1.0 } else { hit.t.min(self.rays.t_max) }
    }

    /// Returns a packet of up to [`RAYS`] rays. `None` if they are better traced one by one.
    #[inline(always)]
    fn packet<S: Simd>(&self, first: usize, count: usize) -> Option<RoundPacket<S>> {
        if self.stats.is_some() || (count as u32) < MIN_PACKET {
            return None;
        }
        let (mut origins, mut directions) = ([Vec3::ZERO; RAYS], [Vec3::ZERO; RAYS]);
        let mut limits = [-1.0; RAYS];
        for lane in 0..RAYS {
            let i = first + lane.min(count - 1);
            (origins[lane], directions[lane]) = (self.rays.origins[i], self.rays.directions[i]);
            if lane < count {
                limits[lane] = self.limit(&self.hits[i]);
            }
        }
        RoundPacket::new(&origins, &directions, limits, self.size, self.bvh.bounds())
    }

    /// Traces the rays of a packet, the first of which has the number `first`.
    #[inline(always)]
    fn trace_packet<S: Simd>(&mut self, mut packet: RoundPacket<S>, first: usize, stacks: &mut Stacks) {
        let mut limit = packet.greatest_limit();
        stacks.packet.clear();
        stacks.packet.push(self.root());
        while let Some(entry) = stacks.packet.pop() {
            if entry.near > limit {
                continue;
            }
            let Entry { level, index, radius, .. } = entry;
            // The root has no box.
            if (level as usize) < self.bvh.level_count() {
                let (parent, child) = (index as usize / WIDTH, index as usize % WIDTH);
                let near = packet.near_box(self.bvh.node(level as usize, parent), child, radius);
                if near.count_ones() < MIN_PACKET {
                    for lane in Bits(near) {
                        self.trace(first + lane, entry, &mut stacks.single);
                        packet.limit[lane] = self.limit(&self.hits[first + lane]);
                    }
                    limit = if near == 0 { limit } else { packet.greatest_limit() };
                    continue;
                }
            }
            if level == 0 {
                self.leaf_of_packet(index as usize, &mut packet, first);
                limit = packet.greatest_limit();
                continue;
            }
            let children = packet.near_children(self.bvh.node(level as usize - 1, index as usize), limit);
            let mut sorted = Children::default();
            for child in Bits(children.mask) {
                let (near, radius) = (children.near[child], children.radius[child]);
                let index = index * WIDTH as u32 + child as u32;
                sorted.insert(Entry { level: level - 1, index, near, radius });
            }
            stacks.packet.extend_from_slice(sorted.entries());
        }
    }

    /// Intersects the items of a leaf with the rays of a packet.
    #[inline(always)]
    fn leaf_of_packet<S: Simd>(&mut self, leaf: usize, packet: &mut RoundPacket<S>, first: usize) {
        for item in self.bvh.leaf(leaf) {
            for lane in Bits(item.near_rays(packet)) {
                let i = first + lane;
                if let Some(hit) = self.closer(item, i, &self.ray(i), self.hits[i]) {
                    self.hits[i] = hit;
                    packet.limit[lane] = self.limit(&hit);
                }
            }
        }
    }

    /// Traces ray number `i` from an entry on.
    #[inline(always)]
    fn trace(&mut self, i: usize, from: Entry, stack: &mut Vec<Entry>) {
        let ray = self.ray(i);
        if !(ray.dd > 0.0 && ray.dd.is_finite() && ray.o.is_finite()) {
            return;
        }
        let (o, d) = (self.rays.origins[i], self.rays.directions[i]);
        let test = BoxTest::new(o, d, self.size, self.bvh.bounds());
        let mut visits = TraversalStats::default();
        let mut hit = self.hits[i];
        stack.clear();
        stack.push(from);
        while let Some(Entry { level, index, near, .. }) = stack.pop() {
            let limit = self.limit(&hit);
            if near > limit {
                continue;
            }
            if level == 0 {
                let items = self.bvh.leaf(index as usize);
                visits.blocks += 1;
                visits.triangles += items.len() as u32;
                for item in Bits(T::near(items, &test, limit)) {
                    hit = self.closer(&items[item], i, &ray, hit).unwrap_or(hit);
                }
                continue;
            }
            visits.nodes += 1;
            let nears = test.near(self.bvh.node(level as usize - 1, index as usize));
            let mut sorted = Children::default();
            for (child, near) in nears.into_iter().enumerate() {
                // False for NaN.
                if near <= limit {
                    let index = index * WIDTH as u32 + child as u32;
                    sorted.insert(Entry { level: level - 1, index, near, radius: 0.0 });
                }
            }
            stack.extend_from_slice(sorted.entries());
        }
        self.hits[i] = hit;
        if let Some(stats) = &mut self.stats {
            stats[i].add(visits);
        }
    }

    /// Returns the hit of ray number `i` with an item if it comes before another one.
    #[inline(always)]
    fn closer(&self, item: &T, i: usize, ray: &Ray64, before: Hit) -> Option<Hit> {
        let t = item.enter(ray, &self.size)? as f32;
        let after = self.rays.after(i);
        if !(t > 0.0 && t <= before.t && t <= self.rays.t_max && t >= after.t) {
            return None;
        }
        let (id, alpha_mode) = self.ids.hit_id(item.id());
        if id == self.rays.source(i) || (self.query == RoundQuery::Occluder && alpha_mode == AlphaMode::Blend)
        {
            return None;
        }
        let has_mask = matches!(alpha_mode, AlphaMode::Mask(_));
        let hit = Hit { t, id };
        let counts = hit.before(&before)
            && after.before(&hit)
            && (!has_mask || self.filter.accepts(id, self.rays.origins[i], self.rays.directions[i]));
        counts.then_some(hit)
    }
}

/// The children of a node that are visited, the nearest last.
struct Children {
    entries: [Entry; WIDTH],
    count: usize,
}

impl Default for Children {
    #[inline(always)]
    fn default() -> Children {
        Children { entries: [Entry { level: 0, index: 0, near: 0.0, radius: 0.0 }; WIDTH], count: 0 }
    }
}

impl Children {
    #[inline(always)]
    fn insert(&mut self, child: Entry) {
        let mut at = self.count;
        while at > 0 && self.entries[at - 1].near < child.near {
            self.entries[at] = self.entries[at - 1];
            at -= 1;
        }
        self.entries[at] = child;
        self.count += 1;
    }

    #[inline(always)]
    fn entries(&self) -> &[Entry] {
        &self.entries[..self.count]
    }
}

/// The numbers of the bits that are set, in ascending order. An iterator with the kernel's instructions, as a closure
/// would not have.
struct Bits(u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let bit = self.0.trailing_zeros() as usize;
        let is_set = self.0 != 0;
        self.0 &= self.0.wrapping_sub(1);
        is_set.then_some(bit)
    }
}
