//! Builds an eight-wide BVH over boxes by the surface area heuristic (SAH), from obvhs's binary BVHs: parallel locally
//! ordered clustering (PLOC; Meister and Bittner, “Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy
//! Construction”, 2018).
//!
//! The boxes are split into Morton clusters. Each has a tree of its own, which one thread builds and converts
//! while all of it is in the processor's cache; over a large scene as a whole, the builder would mostly wait for
//! memory. A few branches of each cluster's tree are kept, by opening the largest boxes first, and one more tree is
//! built over the branches of all clusters. So a box that sticks out of its cluster, such as a large floor among
//! small objects, ends up above it.

use obvhs::aabb::Aabb as ObvhsAabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{BvhBuildParams, ploc::PlocSearchDistance};
use rayon::prelude::*;

use crate::build::bvh2_to_bvh8::WideConverter;
use crate::build::leaf_groups::LeafGroups;
use crate::build::leaf_packing::LeafCapacity;
use crate::build::morton_clusters::{MortonClusters, MortonKey};
use crate::build::subtree::{Child, Subtree};
use crate::bvh::aabb::Aabb;
use crate::bvh::bvh8::{Bvh8, Bvh8Node, LEAF_BIT, WIDTH};
use crate::bvh::huge_pages::HugePageArray;
use crate::bvh::occlusion_order::OcclusionCost;
use crate::settings::Preset;
use blinn_core::cancellation::{CancelToken, Cancelled};

/// A cluster of neighbouring boxes, and what is in them.
pub(crate) trait Cluster {
    /// The contents of leaves.
    type Leaves: Send + Sync;

    /// The boxes. Equal ones should be merged: a great many of them make the builder very slow.
    fn boxes(&self) -> &[ObvhsAabb];

    /// Number of leaf entries in box `i`.
    fn entry_count(&self, i: u32) -> u32;

    /// Makes leaves, each of the boxes with these indices.
    fn into_leaves<'a>(self, leaves: impl Iterator<Item = &'a [u32]>) -> ClusterLeaves<Self::Leaves>;
}

/// The leaves of a cluster.
pub(crate) struct ClusterLeaves<L> {
    pub contents: L,
    /// Number of each leaf within the cluster: the index of its first block, or its own index.
    pub numbers: Vec<u32>,
    /// End of the numbers: blocks or leaves.
    pub end: u32,
    /// Occlusion cost of each leaf, until the cluster's nodes have theirs.
    pub occlusion_costs: Vec<OcclusionCost>,
}

/// How a tree is built.
#[derive(Clone, Copy)]
struct BuildParams {
    obvhs: BvhBuildParams,
    /// Maximum number of boxes in a cluster.
    max_cluster_size: usize,
    /// Branches of a cluster's tree that the tree over all clusters sees.
    branches: usize,
}

/// Boxes whose tree a processor core builds in its own cache.
const CLUSTER_SIZE: usize = 4096;

impl BuildParams {
    /// The parameters of a preset for leaves of this capacity; `None` for no tree.
    fn new(preset: Preset, capacity: LeafCapacity) -> Option<BuildParams> {
        let params = |obvhs: BvhBuildParams, max_cluster_size: usize| {
            Some(BuildParams { obvhs, max_cluster_size, branches: 16 })
        };
        match preset {
            Preset::BruteForce => None,
            Preset::Fast => params(BvhBuildParams::fastest_build(), CLUSTER_SIZE),
            Preset::Medium => {
                // Over leaf groups, reinsertion gains nothing.
                let reinsertion_batch_ratio = if capacity.entries_per_block > 1 { 0.0 } else { 0.02 };
                let obvhs = full_search_params(PlocSearchDistance::Low, reinsertion_batch_ratio);
                params(obvhs, CLUSTER_SIZE)
            }
            Preset::Slow => params(BvhBuildParams::slow_build(), usize::MAX),
        }
    }
}

/// obvhs's fast build with the full PLOC search distance from the first round on: that makes fewer nodes and blocks.
const fn full_search_params(
    ploc_search_distance: PlocSearchDistance,
    reinsertion_batch_ratio: f32,
) -> BvhBuildParams {
    BvhBuildParams {
        ploc_search_distance,
        search_depth_threshold: 0,
        reinsertion_batch_ratio,
        ..BvhBuildParams::fast_build()
    }
}

/// Builds a BVH over the boxes of `keys` with leaves of at most `capacity`, or of one box that holds more. `bounds` returns
/// the box with an index, and `make_cluster` makes the cluster of some boxes. Leaf numbers count through the clusters,
/// whose leaves are returned in order.
///
/// The tree depends on the boxes only, not on the number of threads.
///
/// # Errors
/// The build was cancelled.
pub(crate) fn build<C: Cluster>(
    keys: Vec<MortonKey>,
    bounds: impl Fn(usize) -> ObvhsAabb + Sync,
    make_cluster: impl Fn(&[MortonKey]) -> C + Sync,
    capacity: LeafCapacity,
    preset: Preset,
    cancel: &CancelToken,
) -> Result<(Bvh8, Vec<ClusterLeaves<C::Leaves>>), Cancelled> {
    let params = BuildParams::new(preset, capacity);
    let max_cluster_size = params.map_or(usize::MAX, |params| params.max_cluster_size);
    let clusters = MortonClusters::new(keys, bounds, max_cluster_size);
    build_clusters(clusters, make_cluster, capacity, params, cancel)
}

fn build_clusters<C: Cluster>(
    clusters: MortonClusters,
    make_cluster: impl Fn(&[MortonKey]) -> C + Sync,
    capacity: LeafCapacity,
    params: Option<BuildParams>,
    cancel: &CancelToken,
) -> Result<(Bvh8, Vec<ClusterLeaves<C::Leaves>>), Cancelled> {
    // The tree of a single cluster is the tree of all.
    let branches = |params: BuildParams| if clusters.len() > 1 { params.branches } else { 1 };
    let params = params.map(|params| BuildParams { branches: branches(params), ..params });
    let build = |keys: &[MortonKey]| {
        cancel.check()?;
        Ok(ClusterTree::build(make_cluster(keys), capacity, params))
    };
    let built: Result<Vec<_>, Cancelled> = clusters.par_iter().with_max_len(1).map(build).collect();
    drop(clusters);
    let (trees, leaves): (Vec<ClusterTree>, Vec<_>) = built?.into_iter().unzip();
    Ok((merge(&trees, &leaves), leaves))
}

/// The tree of a cluster.
struct ClusterTree {
    subtree: Subtree,
    branches: Vec<Branch>,
}

/// A part of a tree.
#[derive(Clone, Copy)]
struct Branch {
    root: Child,
    occlusion_cost: OcclusionCost,
}

impl ClusterTree {
    fn build<C: Cluster>(
        cluster: C,
        capacity: LeafCapacity,
        params: Option<BuildParams>,
    ) -> (ClusterTree, ClusterLeaves<C::Leaves>) {
        let mut subtree = Subtree::default();
        let boxes = cluster.boxes();
        let roots: Vec<Child> = match params {
            Some(params) => {
                let entry_count = |i| cluster.entry_count(i);
                let groups = LeafGroups::new(boxes, entry_count, capacity.entries_per_block);
                let bvh2 = build_binary(&groups.boxes, params.obvhs);
                let converter = WideConverter::new(&bvh2, &groups, boxes, entry_count, capacity);
                let branches = converter.branches(params.branches);
                branches.into_iter().map(|i| converter.convert(i, &mut subtree)).collect()
            }
            None => {
                let bounds = Aabb::union_of(boxes.iter().map(|&aabb| aabb.into()));
                vec![subtree.add_leaf(0..boxes.len() as u32, bounds)]
            }
        };
        let mut leaves = cluster.into_leaves(subtree.leaves());
        let node_costs = subtree.sort_children_and_compute_costs(&leaves.occlusion_costs);
        let branch = |root: Child| Branch {
            root,
            occlusion_cost: root.occlusion_cost(&leaves.occlusion_costs, &node_costs),
        };
        let branches = roots.into_iter().map(branch).collect();
        // All clusters are in memory at once: keep only what merging needs.
        subtree.drop_leaves();
        leaves.occlusion_costs = Vec::new();
        (ClusterTree { branches, subtree }, leaves)
    }
}

/// Builds a binary BVH with one box in each leaf.
fn build_binary(boxes: &[ObvhsAabb], params: BvhBuildParams) -> Bvh2 {
    let params = BvhBuildParams { max_prims_per_leaf: 1, ..params };
    build_bvh2(boxes, params, &mut std::time::Duration::default())
}

/// Builds the tree over the branches of all clusters, one branch in each leaf, and returns it as a branch. Branches
/// are few and most rays pass here, so that time is well spent.
fn build_top(branches: &[(usize, Branch)], top: &mut Subtree) -> Branch {
    let boxes: Vec<ObvhsAabb> = branches.iter().map(|(_, branch)| branch.root.bounds().into()).collect();
    let bvh2 = build_binary(&boxes, full_search_params(PlocSearchDistance::Medium, 1.0));
    // With more entries than a leaf's capacity, branches are never put into one leaf.
    let entry_count = |_| 2;
    let groups = LeafGroups::single_boxes(&boxes, entry_count);
    let root = WideConverter::new(&bvh2, &groups, &boxes, entry_count, LeafCapacity::ONE).convert(0, top);
    let leaf_costs: Vec<OcclusionCost> =
        top.leaves().map(|leaf| branches[leaf[0] as usize].1.occlusion_cost).collect();
    let node_costs = top.sort_children_and_compute_costs(&leaf_costs);
    Branch { root, occlusion_cost: root.occlusion_cost(&leaf_costs, &node_costs) }
}

/// Where a cluster's nodes and leaf numbers begin in the merged BVH.
#[derive(Clone, Copy)]
struct Offset {
    node: u32,
    leaf: u32,
}

/// Returns the offsets of all clusters, whose nodes follow `top_nodes` nodes.
fn offsets<L>(trees: &[ClusterTree], leaves: &[ClusterLeaves<L>], top_nodes: usize) -> Vec<Offset> {
    let mut next = Offset { node: top_nodes as u32, leaf: 0 };
    let advance = |(tree, leaves): (&ClusterTree, &ClusterLeaves<L>)| {
        let after =
            Offset { node: next.node + tree.subtree.node_count() as u32, leaf: next.leaf + leaves.end };
        std::mem::replace(&mut next, after)
    };
    trees.iter().zip(leaves).map(advance).collect()
}

/// Merges the trees of all clusters below the tree over their branches.
fn merge<L: Sync>(trees: &[ClusterTree], leaves: &[ClusterLeaves<L>]) -> Bvh8 {
    let branches: Vec<(usize, Branch)> = trees
        .iter()
        .enumerate()
        .flat_map(|(cluster, tree)| tree.branches.iter().map(move |&branch| (cluster, branch)))
        .collect();
    let mut top = Subtree::default();
    let top_branch = (branches.len() > 1).then(|| build_top(&branches, &mut top));
    let offsets = offsets(trees, leaves, top.node_count());
    let in_cluster = |cluster: usize, child: Child| match child {
        Child::Leaf(bounds, leaf) => {
            (bounds, LEAF_BIT | (offsets[cluster].leaf + leaves[cluster].numbers[leaf as usize]))
        }
        Child::Node(bounds, node) => (bounds, offsets[cluster].node + node),
    };
    // A leaf of the top tree is a branch.
    let in_top = |child: Child| match child {
        Child::Leaf(_, leaf) => {
            let (cluster, branch) = branches[top.leaf(leaf as usize)[0] as usize];
            in_cluster(cluster, branch.root)
        }
        Child::Node(bounds, node) => (bounds, node),
    };
    // Part 0 is the top tree, part n + 1 the tree of cluster n.
    let parts: Vec<usize> = (0..=trees.len()).collect();
    let subtree = |part: usize| if part == 0 { &top } else { &trees[part - 1].subtree };
    let node_count = |&part: &usize| subtree(part).node_count();
    let nodes = HugePageArray::from_parts(&parts, node_count, |&part, nodes: &mut [Bvh8Node]| {
        for (i, node) in nodes.iter_mut().enumerate() {
            let mut children = [(Aabb::EMPTY, LEAF_BIT); WIDTH];
            let own = subtree(part).node(i);
            for (to, &child) in children.iter_mut().zip(own) {
                *to = if part == 0 { in_top(child) } else { in_cluster(part - 1, child) };
            }
            *node = Bvh8Node::new(&children[..own.len()]);
        }
    });
    let (root, occlusion_cost) = match (top_branch, branches.first()) {
        (Some(all), _) => (Some(in_top(all.root).1), all.occlusion_cost),
        (None, Some(&(cluster, only))) => (Some(in_cluster(cluster, only.root).1), only.occlusion_cost),
        (None, None) => (None, OcclusionCost::default()),
    };
    let bounds = Aabb::union_of(branches.iter().map(|(_, branch)| branch.root.bounds()));
    Bvh8 { nodes, root, bounds, occlusion_cost }
}

#[cfg(test)]
mod tests;
