//! What a way through the trees costs, counted: nodes and blocks that a ray looks into, and how many
//! of them a ray may be expected to.
//!
//! The counting walk is a plain one of its own, of one ray at a time in f64, so that tracing counts
//! nothing. It meets the same nodes in the same order as single rays do, whatever the instructions.

use glam::DVec3;

use crate::accel::bvh::aabb::Aabb;
use crate::accel::bvh::blas::{Blas, limit};
use crate::accel::bvh::bvh8::{Bvh8, LEAF_BIT, NEAR_FACTOR, Octant, direction_reciprocal};
use crate::accel::bvh::tlas::BlasInstance;
use crate::accel::ray_batch::{AnyHitFilter, RayBatch};
use crate::accel::traverse::hit::LocalRay;
use crate::accel::traverse::query::{ClosestHit, RayContext, RayQuery};
use crate::accel::{Accel, Lane};
use crate::geometry::{EPSILON, Hit, HitId};

/// What a ray looked into until its closest hit was known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraversalStats {
    /// Inner nodes of all levels, each with up to eight boxes.
    pub nodes: u32,
    /// Blocks of up to four triangles.
    pub blocks: u32,
}

impl Accel {
    /// The closest hits of [`Accel::intersect`], each with the steps that its ray takes when it goes
    /// alone. Slow: for pictures of what trees cost, not for pictures of scenes.
    pub fn intersect_with_stats(
        &self,
        rays: &RayBatch,
        cutouts: &dyn AnyHitFilter,
    ) -> Vec<(Hit, TraversalStats)> {
        let lane = Lane::new(self);
        let one = |i: usize| {
            let (o, d) = (rays.origins[i], rays.directions[i]);
            let best = Hit { t: rays.t_max, id: HitId::NONE };
            let asked = RayContext { o, d, cutouts };
            let query = ClosestHit { asked, cull: rays.cull_back_faces, after: rays.after(i), best };
            let mut counter = Counter { lane: &lane, query, steps: TraversalStats::default() };
            if let Some(ray) = LocalRay::new(o.as_dvec3(), d.as_dvec3()) {
                counter.enter_all(&ray);
            }
            let Counter { query: ClosestHit { best, .. }, steps, .. } = counter;
            (if best.is_miss() { Hit::MISS } else { best }, steps)
        };
        (0..rays.len()).map(one).collect()
    }

    /// The cost of the trees by the surface area heuristic: how many nodes and blocks a line through
    /// the scene's box looks into, if lines lie anywhere alike and nothing ends them. 0 for an empty
    /// scene.
    pub fn sah_cost(&self) -> f64 {
        let blocks = |tree: &Blas| {
            let of_leaf = |leaf: u32| {
                let blocks = &tree.blocks[leaf as usize..];
                (1 + blocks.iter().take_while(|block| !block.is_last_in_leaf()).count()) as f64
            };
            expected(&tree.bvh, of_leaf)
        };
        let meshes: Vec<f64> = self.meshes.values().map(blocks).collect();
        let placed = expected(&self.top.bvh, |leaf| {
            self.top.parts(leaf).iter().map(|part: &BlasInstance| meshes[part.tree as usize]).sum()
        });
        let mut trees: Vec<(Aabb, f64)> = self.worlds.iter().map(|w| (w.bvh.bounds, blocks(w))).collect();
        trees.push((self.top.bvh.bounds, placed));
        trees.retain(|&(_, cost)| cost > 0.0);
        let all = trees.iter().map(|tree| tree.0).reduce(Aabb::union);
        let share = |bounds: Aabb| {
            all.filter(|all| all.half_area() > 0.0).map_or(1.0, |all| bounds.half_area() / all.half_area())
        };
        trees.iter().map(|&(bounds, cost)| cost * share(bounds)).sum()
    }
}

/// The nodes that a line through a tree's box meets, plus for each leaf that it meets what is in it.
pub(crate) fn expected(tree: &Bvh8, in_leaf: impl Fn(u32) -> f64) -> f64 {
    let Some(root) = tree.root else { return 0.0 };
    if root & LEAF_BIT != 0 {
        return in_leaf(root & !LEAF_BIT);
    }
    let whole = tree.bounds.half_area();
    // A box without any surface is met in its entirety or not at all.
    let share = |bounds: Aabb| if whole > 0.0 { (bounds.half_area() / whole).min(1.0) } else { 1.0 };
    let mut cost = 1.0;
    for node in tree.nodes.iter() {
        for slot in 0..node.count() {
            let child = node.child[slot];
            cost += share(node.bounds(slot))
                * if child & LEAF_BIT == 0 { 1.0 } else { in_leaf(child & !LEAF_BIT) };
        }
    }
    cost
}

/// A ray on its way.
struct Counter<'a, 'q> {
    lane: &'a Lane<'a>,
    query: ClosestHit<'q>,
    steps: TraversalStats,
}

impl Counter<'_, '_> {
    fn enter_all(&mut self, ray: &LocalRay) {
        let Accel { top, worlds, .. } = self.lane.accel;
        for world in worlds {
            self.enter_triangles(world, ray, None);
        }
        let pad = f64::from(top.pad(ray.o));
        self.walk(&top.bvh, ray, pad, |counter, leaf| {
            for BlasInstance { instance, tree, frame } in top.parts(leaf) {
                let triangles = counter.lane.meshes[*tree as usize];
                counter.enter_triangles(triangles, &frame.ray(ray), Some(*instance));
            }
        });
    }

    fn enter_triangles(&mut self, triangles: &Blas, ray: &LocalRay, instance: Option<u32>) {
        self.walk(&triangles.bvh, ray, 0.0, |counter, leaf| {
            for block in &triangles.blocks[leaf as usize..] {
                counter.steps.blocks += 1;
                for lane in 0..block.count() {
                    if let Some(met) = ray.intersect_f64(&block.vertices(lane)) {
                        // The closest hit never ends a walk.
                        triangles.report_hit(block, lane, met, instance, &mut counter.query);
                    }
                }
                if block.is_last_in_leaf() {
                    break;
                }
            }
        });
    }

    /// Leads the ray through a tree whose boxes are `pad` wider, near children first.
    fn walk(&mut self, tree: &Bvh8, ray: &LocalRay, pad: f64, mut enter: impl FnMut(&mut Self, u32)) {
        let Some(root) = tree.root else { return };
        let boxes = Boxes::new(ray, pad);
        let start = f64::from(ray.to_local_t(self.query.t_min()) * NEAR_FACTOR);
        let mut stack = vec![(root, start)];
        while let Some((here, near)) = stack.pop() {
            if near > f64::from(limit(ray, &self.query)) {
                continue;
            }
            if here & LEAF_BIT != 0 {
                enter(self, here & !LEAF_BIT);
                continue;
            }
            self.steps.nodes += 1;
            let node = &tree.nodes[here as usize];
            let to = f64::from(limit(ray, &self.query));
            for slot in node.order(boxes.octant).map(|slot| slot as usize & 7) {
                if slot < node.count()
                    && let Some(near) = boxes.enters(node.bounds(slot), start, to)
                {
                    stack.push((node.child[slot], near));
                }
            }
        }
    }
}

/// A ray prepared for boxes.
struct Boxes {
    o: DVec3,
    r: DVec3,
    pad: f64,
    octant: Octant,
}

impl Boxes {
    fn new(ray: &LocalRay, pad: f64) -> Boxes {
        let d = ray.d.as_vec3();
        Boxes { o: ray.o, r: direction_reciprocal(d).as_dvec3(), pad, octant: Octant::of(d) }
    }

    /// Where the ray enters a box, if it does before it leaves it; with slack for what is rounded.
    fn enters(&self, bounds: Aabb, start: f64, limit: f64) -> Option<f64> {
        const SLACK: f64 = 4.0 * EPSILON as f64;
        let (mut near, mut far) = (start, limit);
        for k in 0..3 {
            let (o, r) = (self.o[k], self.r[k]);
            let wider = self.pad + SLACK * o.abs();
            let (a, b) =
                ((f64::from(bounds.min[k]) - wider - o) * r, (f64::from(bounds.max[k]) + wider - o) * r);
            near = near.max(a.min(b) - SLACK * a.min(b).abs());
            far = far.min(a.max(b) + SLACK * a.max(b).abs());
        }
        (near <= far).then_some(near)
    }
}
