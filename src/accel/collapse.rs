//! From obvhs's binary tree to a wide one.
//!
//! Which binary nodes become wide ones is decided by dynamic programming over expected costs (a
//! box is met in proportion to its surface): for each binary node the cheapest forest of up to
//! 1…7 wide children that covers it (Ylitie, Karras and Laine, Efficient Incoherent Ray Traversal
//! on GPUs Through Compressed Wide BVHs, 2017, section 3.3). Nothing here recurses: trees may be as
//! deep as they have entries.

use glam::{Vec3, Vec3A};
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{BvhBuildParams, ploc::PlocSearchDistance};
use rayon::prelude::*;

use super::Preset;
use super::wide::{Box3, LEAF, Node, WIDTH, Wide};

/// A tree over `boxes` and what is in each leaf: leaf i holds the next `ends[i] − ends[i − 1]` of
/// `members`, which are indices of boxes.
pub(super) struct Collapsed {
    pub wide: Wide,
    pub members: Vec<u32>,
    pub ends: Vec<u32>,
}

/// Cost of visiting a node, in units of what a leaf costs besides its entries.
const NODE_COST: f32 = 1.0;
/// Cost of a leaf: so much, and so much for each entry.
const LEAF_COST: f32 = 0.6;
const ENTRY_COST: f32 = 0.2;

/// obvhs's parameters; `None` for no tree. One entry to a leaf: leaves are made here.
fn params(preset: Preset) -> Option<BvhBuildParams> {
    let one = |params: BvhBuildParams| BvhBuildParams { pre_split: false, max_prims_per_leaf: 1, ..params };
    match preset {
        Preset::Flat => None,
        Preset::Fast => Some(one(BvhBuildParams::fastest_build())),
        Preset::Medium => Some(one(BvhBuildParams {
            ploc_search_distance: PlocSearchDistance::Low,
            search_depth_threshold: 2,
            reinsertion_batch_ratio: 0.02,
            ..BvhBuildParams::fast_build()
        })),
        Preset::Slow => Some(one(BvhBuildParams::slow_build())),
    }
}

/// Builds a tree over `boxes`, box i holding `sizes(i)` entries, with leaves of at most `capacity`
/// entries, or of one box that holds more. Equal boxes should be one box: a great many of them
/// make the builder very slow.
pub(super) fn build(boxes: &[Box3], sizes: impl Fn(u32) -> u32, capacity: u32, preset: Preset) -> Collapsed {
    let bounds = boxes.par_iter().copied().reduce(|| (Vec3::MAX, Vec3::MIN), union);
    let all = 0..boxes.len() as u32;
    let Some(params) = params(preset).filter(|_| boxes.len() > 1) else {
        let root = (!boxes.is_empty()).then_some(LEAF);
        let wide = Wide { root, bounds, ..Wide::default() };
        return Collapsed { wide, ends: root.map(|_| all.end).into_iter().collect(), members: all.collect() };
    };
    let boxes: Vec<obvhs::aabb::Aabb> = boxes
        .par_iter()
        .map(|&(min, max)| obvhs::aabb::Aabb { min: Vec3A::from(min), max: Vec3A::from(max) })
        .collect();
    let built = build_bvh2(&boxes, params, &mut std::time::Duration::default());
    drop(boxes);
    let forest = Forest::plan(&built, &sizes, capacity);
    forest.emit(&built, bounds)
}

fn union(a: Box3, b: Box3) -> Box3 {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Of at most how many roots the cheapest forest of a node has how many, and how many of those are
/// under its first child.
#[derive(Clone, Copy, Default)]
struct Choice(u8);

impl Choice {
    fn new(roots: usize, first: usize) -> Choice {
        Choice((roots << 4 | first) as u8)
    }

    fn roots(self) -> usize {
        usize::from(self.0 >> 4)
    }

    fn first(self) -> usize {
        usize::from(self.0 & 15)
    }
}

/// The cheapest forests of all binary nodes.
struct Forest {
    capacity: u32,
    /// Entries under each node.
    entries: Vec<u32>,
    /// choices[n][i]: for at most i + 1 roots. The last says how a wide node is made of n.
    choices: Vec<[Choice; WIDTH]>,
}

impl Forest {
    fn plan(built: &Bvh2, sizes: &impl Fn(u32) -> u32, capacity: u32) -> Forest {
        let nodes = &built.nodes;
        let mut entries = vec![0u32; nodes.len()];
        let mut choices = vec![[Choice::new(1, 0); WIDTH]; nodes.len()];
        // costs[n][i]: of at most i + 1 roots.
        let mut costs = vec![[0f32; WIDTH - 1]; nodes.len()];
        for i in upwards(built) {
            let i = i as usize;
            let node = &nodes[i];
            let (a, b) = (node.first_index as usize, node.first_index as usize + 1);
            entries[i] = match node.is_leaf() {
                true => sizes(built.primitive_indices[a]),
                false => entries[a].saturating_add(entries[b]),
            };
            let area = half_area(node.aabb());
            if node.is_leaf() || entries[i] <= capacity {
                costs[i] = [area * (LEAF_COST + ENTRY_COST * entries[i] as f32); WIDTH - 1];
                continue;
            }
            // Two roots and more; then one, which is a wide node over the best eight or fewer.
            let (mut best, mut choice) = ([f32::INFINITY; WIDTH], [Choice::default(); WIDTH]);
            for roots in 2..=WIDTH {
                (best[roots - 1], choice[roots - 1]) = (best[roots - 2], choice[roots - 2]);
                for first in 1..roots {
                    let sum = costs[a][first - 1] + costs[b][roots - first - 1];
                    if sum < best[roots - 1] {
                        (best[roots - 1], choice[roots - 1]) = (sum, Choice::new(roots, first));
                    }
                }
            }
            let whole = best[WIDTH - 1] + area * NODE_COST;
            for roots in 1..WIDTH {
                if whole <= best[roots - 1] {
                    (best[roots - 1], choice[roots - 1]) = (whole, Choice::new(1, 0));
                }
                costs[i][roots - 1] = best[roots - 1];
            }
            choices[i] = choice;
        }
        Forest { capacity, entries, choices }
    }

    /// Makes the wide tree, parents before children.
    fn emit(&self, built: &Bvh2, bounds: Box3) -> Collapsed {
        let nodes = &built.nodes;
        let is_leaf = |i: u32| nodes[i as usize].is_leaf() || self.entries[i as usize] <= self.capacity;
        let mut members = Vec::with_capacity(built.primitive_indices.len());
        let mut ends: Vec<u32> = Vec::new();
        let mut under = Vec::new();
        let mut leaf = |root: u32| {
            under.push(root);
            while let Some(i) = under.pop() {
                let node = &nodes[i as usize];
                match node.is_leaf() {
                    true => members.push(built.primitive_indices[node.first_index as usize]),
                    false => under.extend([node.first_index + 1, node.first_index]),
                }
            }
            ends.push(members.len() as u32);
            LEAF | (ends.len() - 1) as u32
        };
        if is_leaf(0) {
            let root = Some(leaf(0));
            return Collapsed { wide: Wide { root, bounds, ..Wide::default() }, members, ends };
        }
        // The children of all wide nodes, one node after the other, and where each node's begin.
        let mut children: Vec<(Box3, u32)> = Vec::new();
        let mut starts = Vec::new();
        // (a binary node that becomes a wide one, the child that it is)
        let mut todo: Vec<(u32, Option<usize>)> = vec![(0, None)];
        let mut roots: Vec<(u32, usize)> = Vec::new();
        while let Some((i, child)) = todo.pop() {
            if let Some(child) = child {
                children[child].1 = starts.len() as u32;
            }
            starts.push(children.len());
            let split = |i: u32, choice: Choice| {
                let first = nodes[i as usize].first_index;
                [(first + 1, choice.roots() - choice.first()), (first, choice.first())]
            };
            roots.extend(split(i, self.choices[i as usize][WIDTH - 1]));
            while let Some((i, count)) = roots.pop() {
                let choice = self.choices[i as usize][count - 1];
                if !is_leaf(i) && choice.roots() > 1 {
                    roots.extend(split(i, choice));
                    continue;
                }
                let aabb = nodes[i as usize].aabb();
                if !is_leaf(i) {
                    todo.push((i, Some(children.len())));
                }
                children.push(((aabb.min.into(), aabb.max.into()), if is_leaf(i) { leaf(i) } else { 0 }));
            }
        }
        starts.push(children.len());
        let nodes = starts.par_windows(2).map(|range| Node::new(&children[range[0]..range[1]])).collect();
        Collapsed { wide: Wide { nodes, root: Some(0), bounds }, members, ends }
    }
}

/// The nodes of a tree, children before parents.
fn upwards(built: &Bvh2) -> impl Iterator<Item = u32> {
    let mut order: Vec<u32> = Vec::with_capacity(built.nodes.len());
    order.push(0);
    let mut at = 0;
    while let Some(&i) = order.get(at) {
        let node = &built.nodes[i as usize];
        if !node.is_leaf() {
            order.extend([node.first_index, node.first_index + 1]);
        }
        at += 1;
    }
    order.into_iter().rev()
}

fn half_area(b: &obvhs::aabb::Aabb) -> f32 {
    let d = b.max - b.min;
    d.x * d.y + d.y * d.z + d.z * d.x
}
