//! From obvhs's binary trees to a wide one.
//!
//! Each region has a tree of its own, which one thread makes and collapses while all of it is in its
//! processor's cache; trees of large scenes as a whole would wait for memory most of the time. Of each a few
//! branches are taken, the largest boxes opened first, and one more tree is made over those of all: so what
//! sticks out of a region, such as a large floor between small things, hangs above it.

use obvhs::aabb::Aabb as ObvhsAabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams, ploc::PlocSearchDistance};
use rayon::prelude::*;

use crate::accel::Preset;
use crate::accel::build::bvh2_to_bvh8::{Child, Forest, Grown};
use crate::accel::build::leaf_packing::Capacity;
use crate::accel::build::morton_clusters::{MortonClusters, MortonKey};
use crate::accel::build::occlusion_order::OcclusionCost;
use crate::accel::bvh::aabb::Aabb;
use crate::accel::bvh::bvh8::{Bvh8, Bvh8Node, LEAF_BIT, WIDTH};
use crate::accel::bvh::huge_pages::HugePageVec;

/// Boxes that lie together, and what is in them.
pub(crate) trait Region {
    /// What leaves hold.
    type Leaves: Send + Sync;

    /// Equal boxes should be one: a great many of them make the builder very slow.
    fn boxes(&self) -> &[ObvhsAabb];

    /// How many entries of a leaf are in a box.
    fn entries(&self, i: u32) -> u32;

    /// Makes leaves, each of the boxes of these indices.
    fn leaves<'a>(self, members: impl Iterator<Item = &'a [u32]>) -> Filled<Self::Leaves>;
}

/// What leaves of a region hold, in places.
pub(crate) struct Filled<L> {
    pub leaves: L,
    /// Each leaf's first place.
    pub firsts: Vec<u32>,
    pub places: u32,
    /// Each leaf's odds, until the region's nodes have theirs.
    pub odds: Vec<OcclusionCost>,
}

/// How a tree is made; `None` for no tree.
fn plan(preset: Preset) -> Option<Plan> {
    let plan = |params: BvhBuildParams, region: usize| Some(Plan { params, region, branches: 16 });
    match preset {
        Preset::BruteForce => None,
        Preset::Fast => plan(BvhBuildParams::fastest_build(), REGION),
        Preset::Medium => plan(medium(PlocSearchDistance::Low, 0.02), REGION),
        Preset::Slow => plan(BvhBuildParams::slow_build(), usize::MAX),
    }
}

#[derive(Clone, Copy)]
struct Plan {
    params: BvhBuildParams,
    /// Most boxes in a region.
    region: usize,
    /// Of how many branches a region's tree is taken for the tree over all.
    branches: usize,
}

/// Neighbours are sought as far from the first round on as from the last: fewer nodes and blocks come of it.
const fn medium(ploc_search_distance: PlocSearchDistance, reinsertion_batch_ratio: f32) -> BvhBuildParams {
    BvhBuildParams {
        ploc_search_distance,
        search_depth_threshold: 0,
        reinsertion_batch_ratio,
        ..BvhBuildParams::fast_build()
    }
}

/// Boxes whose tree is made in a processor's own cache.
const REGION: usize = 4096;

/// Builds a tree over `boxes`, by regions that `open` makes of their keys, with leaves of at most `capacity`,
/// or of one box that holds more. A leaf's number is that of its first place, where one region's places come
/// after the other's. What leaves hold comes by the region.
///
/// The tree depends on the boxes alone, and not on how many threads there are.
pub(crate) fn build<T: Boundable + Sync, R: Region>(
    boxes: &[T],
    open: impl Fn(&[MortonKey]) -> R + Sync,
    capacity: Capacity,
    preset: Preset,
) -> (Bvh8, Vec<Filled<R::Leaves>>) {
    planned(boxes, open, capacity, plan(preset))
}

fn planned<T: Boundable + Sync, R: Region>(
    boxes: &[T],
    open: impl Fn(&[MortonKey]) -> R + Sync,
    capacity: Capacity,
    plan: Option<Plan>,
) -> (Bvh8, Vec<Filled<R::Leaves>>) {
    let regions = MortonClusters::new(boxes, plan.map_or(usize::MAX, |plan| plan.region));
    // Alone, a region's tree is all there is.
    let plan = plan.map(|plan| Plan { branches: if regions.len() > 1 { plan.branches } else { 1 }, ..plan });
    let part = |keys: &[MortonKey]| Part::new(open(keys), capacity, plan);
    let (parts, leaves): (Vec<Part>, Vec<_>) = regions.par_iter().with_max_len(1).map(part).unzip();
    (join(&parts, &leaves), leaves)
}

/// What became of a region.
struct Part {
    grown: Grown,
    branches: Vec<Branch>,
}

/// A part of a tree.
#[derive(Clone, Copy)]
struct Branch {
    /// What stands for it.
    root: Child,
    odds: OcclusionCost,
}

impl Part {
    fn new<R: Region>(region: R, capacity: Capacity, plan: Option<Plan>) -> (Part, Filled<R::Leaves>) {
        let mut grown = Grown::default();
        let boxes = region.boxes();
        let roots: Vec<Child> =
            match plan {
                Some(plan) => {
                    let built = binary(boxes, plan.params);
                    let forest = Forest::new(&built, boxes, |i| region.entries(i), capacity);
                    forest.branches(plan.branches).into_iter().map(|i| forest.grow(i, &mut grown)).collect()
                }
                None => {
                    vec![grown.add_leaf(
                        0..boxes.len() as u32,
                        Aabb::union_of(boxes.iter().copied().map(Aabb::from)),
                    )]
                }
            };
        let mut leaves = region.leaves(grown.leaves());
        let odds = grown.arrange(&leaves.odds);
        let branch = |root: Child| Branch { root, odds: root.odds(&leaves.odds, &odds) };
        let branches = roots.into_iter().map(branch).collect();
        // All regions are held at once: no more of each than it takes to join them.
        grown.keep_nodes();
        leaves.odds = Vec::new();
        (Part { branches, grown }, leaves)
    }
}

/// One box to a leaf: leaves are made here.
fn binary(boxes: &[ObvhsAabb], params: BvhBuildParams) -> Bvh2 {
    let params = BvhBuildParams { max_prims_per_leaf: 1, ..params };
    build_bvh2(boxes, params, &mut std::time::Duration::default())
}

/// The tree over branches, whose leaves are one branch each: what stands for all of it. They are few, and so
/// many rays pass here that time is well spent.
fn over(branches: &[(usize, Branch)], top: &mut Grown) -> Branch {
    let boxes: Vec<ObvhsAabb> = branches.iter().map(|(_, branch)| branch.root.bounds().into()).collect();
    let built = binary(&boxes, medium(PlocSearchDistance::Medium, 1.0));
    // Boxes that hold more than there is room for are never put together.
    let root = Forest::new(&built, &boxes, |_| 2, Capacity::ONE).grow(0, top);
    let leaves: Vec<OcclusionCost> = top.leaves().map(|leaf| branches[leaf[0] as usize].1.odds).collect();
    let nodes = top.arrange(&leaves);
    Branch { root, odds: root.odds(&leaves, &nodes) }
}

/// One tree of all parts.
fn join<L: Sync>(parts: &[Part], leaves: &[Filled<L>]) -> Bvh8 {
    let branches: Vec<(usize, Branch)> = parts
        .iter()
        .enumerate()
        .flat_map(|(part, of)| of.branches.iter().map(move |&branch| (part, branch)))
        .collect();
    let mut top = Grown::default();
    let highest = (branches.len() > 1).then(|| over(&branches, &mut top));
    // Where each part's nodes and places begin among all. The first nodes are those over the branches.
    let mut next = (top.nodes() as u32, 0);
    let start = |(part, leaves): (&Part, &Filled<L>)| {
        let after = (next.0 + part.grown.nodes() as u32, next.1 + leaves.places);
        std::mem::replace(&mut next, after)
    };
    let starts: Vec<(u32, u32)> = parts.iter().zip(leaves).map(start).collect();
    let placed = |part: usize, child: Child| match child {
        Child::Leaf(bounds, leaf) => {
            (bounds, LEAF_BIT | (starts[part].1 + leaves[part].firsts[leaf as usize]))
        }
        Child::Node(bounds, node) => (bounds, starts[part].0 + node),
    };
    // A leaf of the top is a branch.
    let above = |child: Child| match child {
        Child::Leaf(_, leaf) => {
            let (part, branch) = branches[top.leaf(leaf as usize)[0] as usize];
            placed(part, branch.root)
        }
        Child::Node(bounds, node) => (bounds, node),
    };
    let count = |part: &usize| match part {
        0 => top.nodes(),
        part => parts[part - 1].grown.nodes(),
    };
    let numbers: Vec<usize> = (0..=parts.len()).collect();
    let nodes = HugePageVec::filled(&numbers, count, |&part, nodes: &mut [Bvh8Node]| {
        for (i, node) in nodes.iter_mut().enumerate() {
            let mut children = [(Aabb::default(), LEAF_BIT); WIDTH];
            let own = if part == 0 { top.node(i) } else { parts[part - 1].grown.node(i) };
            for (to, &child) in children.iter_mut().zip(own) {
                *to = if part == 0 { above(child) } else { placed(part - 1, child) };
            }
            *node = Bvh8Node::new(&children[..own.len()]);
        }
    });
    let root = match (highest, branches.first()) {
        (Some(all), _) => Some((above(all.root).1, all.odds)),
        (None, Some(&(part, only))) => Some((placed(part, only.root).1, only.odds)),
        (None, None) => None,
    };
    let (root, odds) = root.unzip();
    let bounds = Aabb::union_of(branches.iter().map(|(_, branch)| branch.root.bounds()));
    Bvh8 { nodes, root, bounds, odds: odds.unwrap_or_default() }
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, Vec3A};

    use super::*;
    use crate::accel::traverse::traversal_stats::expected;

    const CAPACITY: Capacity = Capacity::BLOCKS;

    /// Boxes by their indices; every fiftieth of them needs a second block.
    struct Few {
        boxes: Vec<ObvhsAabb>,
        indices: Vec<u32>,
    }

    fn entries(i: u32) -> u32 {
        if i.is_multiple_of(50) { 6 } else { 1 }
    }

    impl Region for Few {
        type Leaves = Vec<Vec<u32>>;

        fn boxes(&self) -> &[ObvhsAabb] {
            &self.boxes
        }

        fn entries(&self, i: u32) -> u32 {
            entries(self.indices[i as usize])
        }

        fn leaves<'a>(self, members: impl Iterator<Item = &'a [u32]>) -> Filled<Self::Leaves> {
            let leaves: Vec<Vec<u32>> =
                members.map(|leaf| leaf.iter().map(|&i| self.indices[i as usize]).collect()).collect();
            let places = leaves.len() as u32;
            let odds = leaves.iter().map(|leaf| odds(leaf)).collect();
            Filled { leaves, firsts: (0..places).collect(), places, odds }
        }
    }

    /// Some leaves stop much, some little, some nothing.
    fn odds(leaf: &[u32]) -> OcclusionCost {
        OcclusionCost::of_leaf(
            Aabb { min: Vec3::ZERO, max: Vec3::ONE },
            f64::from(leaf[0] % 7) / 2.0,
            1 + leaf.len() as u32 / 3,
        )
    }

    /// A tree and what is in its leaves.
    fn made(boxes: &[ObvhsAabb], plan: Option<Plan>) -> (Bvh8, Vec<Vec<u32>>) {
        let open = |keys: &[MortonKey]| {
            let indices: Vec<u32> = keys.iter().map(|key| key.index() as u32).collect();
            Few { boxes: indices.iter().map(|&i| boxes[i as usize]).collect(), indices }
        };
        let (wide, leaves) = planned(boxes, open, CAPACITY, plan);
        (wide, leaves.into_iter().flat_map(|filled| filled.leaves).collect())
    }

    /// Boxes here and there, crowded in places.
    fn boxes(count: u32) -> Vec<ObvhsAabb> {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        let one = |_| {
            let place = Vec3A::new(next(), next(), next());
            let min = place * place * 100.0;
            ObvhsAabb { min, max: min + Vec3A::new(next(), next(), next()) * 0.1 }
        };
        (0..count).map(one).collect()
    }

    /// That every box is in one leaf, within all that is above it, and no leaf has too much.
    fn check(boxes: &[ObvhsAabb], (wide, leaves): &(Bvh8, Vec<Vec<u32>>)) {
        let mut seen = vec![0; boxes.len()];
        let mut todo: Vec<(u32, Aabb)> = wide.root.map(|root| (root, wide.bounds)).into_iter().collect();
        let mut nodes = 0;
        while let Some((child, within)) = todo.pop() {
            if child & LEAF_BIT != 0 {
                let members = &leaves[(child & !LEAF_BIT) as usize];
                assert!(
                    members.len() == 1 || members.iter().map(|&i| entries(i)).sum::<u32>() <= CAPACITY.leaf
                );
                for &member in members {
                    assert!(within.contains(boxes[member as usize].into()));
                    seen[member as usize] += 1;
                }
                continue;
            }
            nodes += 1;
            let node = &wide.nodes[child as usize];
            for slot in 0..node.count() {
                let inside = node.bounds(slot);
                assert!(within.contains(inside));
                assert!(
                    node.child[slot] & LEAF_BIT != 0 || node.child[slot] > child,
                    "a child before its parent"
                );
                todo.push((node.child[slot], inside));
            }
        }
        assert!(seen.iter().all(|&times| times == 1));
        assert_eq!(nodes, wide.nodes.len());
    }

    #[test]
    fn parents_come_first_and_every_box_is_in_one_leaf_within_all_its_parents() {
        let boxes = boxes(20_000);
        for preset in [Preset::Fast, Preset::Medium, Preset::Slow] {
            for count in [1, 2, 5, 300, REGION, REGION + 1, boxes.len()] {
                check(&boxes[..count], &made(&boxes[..count], plan(preset)));
            }
        }
        let (nothing, leaves) = made(&[], plan(Preset::Medium));
        assert!(nothing.root.is_none() && leaves.is_empty());
    }

    #[test]
    fn children_that_stop_most_for_least_come_first() {
        let boxes = boxes(20_000);
        for preset in [Preset::Medium, Preset::Slow] {
            let (wide, leaves) = made(&boxes, plan(preset));
            let mut nodes = vec![OcclusionCost::default(); wide.nodes.len()];
            for (i, node) in wide.nodes.iter().enumerate().rev() {
                let of = |slot: usize| match node.child[slot] {
                    child if child & LEAF_BIT != 0 => odds(&leaves[(child & !LEAF_BIT) as usize]),
                    child => nodes[child as usize],
                };
                let children: Vec<(Aabb, OcclusionCost)> =
                    (0..node.count()).map(|slot| (node.bounds(slot), of(slot))).collect();
                assert!(children.windows(2).all(|two| two[0].1.worth() >= two[1].1.worth()), "{children:?}");
                let whole = Aabb::union_of(children.iter().map(|child| child.0));
                nodes[i] = OcclusionCost::of_all(whole, children.into_iter());
            }
            assert_eq!(nodes[0], wide.odds);
        }
    }

    #[test]
    fn a_tree_does_not_depend_on_threads() {
        let boxes = boxes(20_000);
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (wide, leaves) = pool.install(|| made(&boxes, plan(Preset::Medium)));
            (bytemuck::cast_slice::<Bvh8Node, u8>(&wide.nodes).to_vec(), wide.root, leaves)
        };
        assert!(with(1) == with(3));
    }

    /// Lines meet hardly more in a tree of regions than in one over all, walls across them or not. These are a
    /// quarter as large as usual; with a sixteenth lines meet a seventh more.
    #[test]
    fn regions_cost_rays_little() {
        let mut boxes = boxes(20_000);
        for walls in [0, 100] {
            for (i, wall) in boxes.iter_mut().take(walls).enumerate() {
                let y = i as f32;
                *wall = ObvhsAabb { min: Vec3A::new(0.0, y, 0.0), max: Vec3A::new(100.0, y, 100.0) };
            }
            let cost = |region: usize| {
                let plan = plan(Preset::Medium).map(|plan| Plan { region, ..plan });
                let (wide, leaves) = made(&boxes, plan);
                expected(&wide, |leaf| leaves[leaf as usize].len() as f64)
            };
            let (regions, one) = (cost(1024), cost(usize::MAX));
            assert!(regions < 1.1 * one, "{walls} walls: {regions} {one}");
        }
    }

    /// Costs that overflow still make a tree.
    #[test]
    fn huge_boxes_make_a_tree() {
        let huge = |i: u32| {
            let min = Vec3A::splat(-1e18 + i as f32 * 1e12);
            ObvhsAabb { min, max: Vec3A::splat(1e18) }
        };
        let boxes: Vec<ObvhsAabb> = (0..300).map(huge).collect();
        for preset in [Preset::Fast, Preset::Medium, Preset::Slow] {
            check(&boxes, &made(&boxes, plan(preset)));
        }
    }
}
