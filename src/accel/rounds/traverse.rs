//! Traversal of the BVHs of points and lines by single rays.

use glam::Vec3;

use super::InstanceIds;
use super::items::{Ray64, RoundItem};
use super::round_bvh::{RoundBvh, RoundNode, WIDTH};
use super::size::RoundSize;
use crate::ray_batch::{HitBatch, HitFilter, RayBatch};
use crate::traverse::traversal_stats::TraversalStats;
use blinn_core::geometry::{Hit, HitId};
use blinn_core::simd::AutovecKernel;
use blinn_scene::AlphaMode;

/// Boxes are enlarged by this fraction of the coordinates of box and ray: more than rounding errs by.
const SLACK: f32 = 4e-6;

/// Finds the points or lines in front of the hits of rays.
pub(super) struct IntersectRounds<'a, T> {
    pub bvh: &'a RoundBvh<T>,
    pub ids: &'a InstanceIds,
    pub size: RoundSize,
    /// True if those with alpha blending are not there.
    pub skips_blended: bool,
    pub rays: &'a RayBatch,
    pub filter: &'a dyn HitFilter,
    pub hits: &'a mut HitBatch,
    /// Receives the nodes and leaves that each ray visits.
    pub stats: Option<&'a mut [TraversalStats]>,
}

impl<T: RoundItem> AutovecKernel for IntersectRounds<'_, T> {
    #[inline(always)]
    fn run(mut self) {
        let mut stack = Vec::new();
        for i in 0..self.rays.len() {
            let (o, d) = (self.rays.origins[i], self.rays.directions[i]);
            let mut search = Search {
                bvh: self.bvh,
                ids: self.ids,
                size: self.size,
                skips_blended: self.skips_blended,
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
    skips_blended: bool,
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

impl<T: RoundItem> Search<'_, T> {
    #[inline(always)]
    fn run(&mut self, stack: &mut Vec<Entry>) {
        let ray =
            Ray64 { o: self.o.as_dvec3(), d: self.d.as_dvec3(), dd: self.d.as_dvec3().length_squared() };
        if !(ray.dd > 0.0 && ray.dd.is_finite() && ray.o.is_finite()) {
            return;
        }
        let test = BoxTest::new(self.o, self.d, self.size, self.bvh.extent());
        stack.clear();
        stack.push(Entry { level: self.bvh.level_count() as u32, index: 0, near: 0.0 });
        while let Some(Entry { level, index, near }) = stack.pop() {
            if near > self.hit.t.min(self.t_max) {
                continue;
            }
            if level == 0 {
                self.leaf(index as usize, &ray);
                continue;
            }
            self.visits.nodes += 1;
            let nears = test.near(self.bvh.node(level as usize - 1, index as usize));
            let limit = self.hit.t.min(self.t_max);
            let first = stack.len();
            for (child, near) in nears.into_iter().enumerate() {
                // False for NaN.
                if near <= limit {
                    // Nearest last.
                    let at = stack[first..].iter().position(|entry| entry.near < near);
                    let index = index * WIDTH as u32 + child as u32;
                    stack.insert(
                        first + at.unwrap_or(stack.len() - first),
                        Entry { level: level - 1, index, near },
                    );
                }
            }
        }
    }

    /// Intersects the items of a leaf.
    #[inline(always)]
    fn leaf(&mut self, leaf: usize, ray: &Ray64) {
        let items = self.bvh.leaf(leaf);
        self.visits.blocks += 1;
        self.visits.triangles += items.len() as u32;
        for item in items {
            let Some(t) = item.enter(ray, &self.size) else { continue };
            let t = t as f32;
            if !(t > 0.0 && t <= self.hit.t && t <= self.t_max && t >= self.after.t) {
                continue;
            }
            let (id, alpha_mode) = self.ids.hit_id(item.id());
            if id == self.source || (self.skips_blended && alpha_mode == AlphaMode::Blend) {
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

/// The test of a ray against the boxes of a node, each enlarged by the greatest radius in it.
struct BoxTest {
    o: [f32; 3],
    inv: [f32; 3],
    /// Direction, and the same without signs, divided by the square of its length: t along the ray.
    t: [f32; 3],
    abs_t: [f32; 3],
    size: RoundSize,
    slack: f32,
}

impl BoxTest {
    #[inline(always)]
    fn new(o: Vec3, d: Vec3, size: RoundSize, extent: f32) -> BoxTest {
        let dd = d.as_dvec3().length_squared();
        let t = (d.as_dvec3() / dd).as_vec3();
        // A component of 0 is as good as the smallest that has an inverse.
        let tiny = d.abs().max_element() * 1e-20;
        let inv = |d: f32| 1.0 / if d.abs() > tiny { d } else { tiny.copysign(d) };
        BoxTest {
            o: o.to_array(),
            inv: d.to_array().map(inv),
            t: t.to_array(),
            abs_t: t.abs().to_array(),
            size,
            slack: SLACK * (o.abs().max_element() + extent),
        }
    }

    /// Returns the t where the ray enters each child's box; NaN where it misses.
    #[inline(always)]
    fn near(&self, node: &RoundNode) -> [f32; WIDTH] {
        let mut out = [f32::NAN; WIDTH];
        for i in 0..WIDTH {
            // The least and the greatest t of the box's points, and the square of their greatest distance.
            let (mut near_t, mut far_t, mut distance2) = (0.0, 0.0, 0.0);
            for axis in 0..3 {
                let (low, high) = (node.min[axis][i] - self.o[axis], node.max[axis][i] - self.o[axis]);
                let (middle, half) =
                    (0.5 * (low + high) * self.t[axis], 0.5 * (high - low) * self.abs_t[axis]);
                near_t += middle - half;
                far_t += middle + half;
                let reach = low.abs().max(high.abs());
                distance2 += reach * reach;
            }
            let t_slack = self.slack * self.abs_t[0].max(self.abs_t[1]).max(self.abs_t[2]) * 4.0;
            let r = self.size.up_to((far_t + t_slack).max(0.0)) * 1.0001 + self.slack;
            let (mut near, mut far) = (0.0f32, f32::INFINITY);
            for axis in 0..3 {
                let a = (node.min[axis][i] - self.o[axis] - r) * self.inv[axis];
                let b = (node.max[axis][i] - self.o[axis] + r) * self.inv[axis];
                near = near.max(a.min(b));
                far = far.min(a.max(b));
            }
            // All spheres that contain the origin are behind the ray: it has left their surfaces.
            let inside = self.size.up_to((near_t - t_slack).max(0.0)) * 0.999 - self.slack;
            let contain_origin = inside > 0.0 && distance2 < inside * inside;
            let hits = near <= far * 1.000_001 && node.min[0][i] <= node.max[0][i] && !contain_origin;
            out[i] = if hits { near * 0.999_999 } else { f32::NAN };
        }
        out
    }
}
