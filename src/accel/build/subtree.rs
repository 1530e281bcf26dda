//! A part of an eight-wide BVH under construction: children by reference, leaves by the indices of their boxes.

use std::ops::Range;

use crate::bvh::aabb::Aabb;
use crate::bvh::bvh8::WIDTH;
use crate::bvh::occlusion_order::OcclusionCost;

/// A child of a wide node: its bounds and its index among the leaves or nodes of the [`Subtree`].
#[derive(Clone, Copy)]
pub(crate) enum Child {
    Leaf(Aabb, u32),
    Node(Aabb, u32),
}

impl Child {
    pub fn bounds(&self) -> Aabb {
        match *self {
            Child::Leaf(bounds, _) | Child::Node(bounds, _) => bounds,
        }
    }

    /// Looks up its occlusion cost in those of all leaves and nodes.
    pub fn occlusion_cost(&self, leaves: &[OcclusionCost], nodes: &[OcclusionCost]) -> OcclusionCost {
        match *self {
            Child::Leaf(_, leaf) => leaves[leaf as usize],
            Child::Node(_, node) => nodes[node as usize],
        }
    }
}

/// Wide nodes and leaves, parents before children.
#[derive(Default)]
pub(crate) struct Subtree {
    /// The children of all nodes, node by node.
    children: Vec<Child>,
    /// End of each node's range in `children`.
    node_ends: Vec<u32>,
    /// Indices of the boxes of all leaves, leaf by leaf.
    boxes: Vec<u32>,
    /// End of each leaf's range in `boxes`.
    leaf_ends: Vec<u32>,
}

impl Subtree {
    /// Adds a leaf.
    pub fn add_leaf(&mut self, boxes: impl IntoIterator<Item = u32>, bounds: Aabb) -> Child {
        self.boxes.extend(boxes);
        self.leaf_ends.push(self.boxes.len() as u32);
        Child::Leaf(bounds, self.leaf_ends.len() as u32 - 1)
    }

    /// Adds a child to the node under construction.
    pub fn add_child(&mut self, child: Child) {
        self.children.push(child);
    }

    /// Adds a child node that is not built yet, and returns the reference for [`Subtree::resolve`].
    pub fn add_unresolved(&mut self, bounds: Aabb) -> usize {
        self.children.push(Child::Node(bounds, 0));
        self.children.len() - 1
    }

    /// Makes a reference point to the node that comes next.
    pub fn resolve(&mut self, reference: usize) {
        let next = self.node_count() as u32;
        if let Child::Node(_, node) = &mut self.children[reference] {
            *node = next;
        }
    }

    /// Ends the node under construction.
    pub fn end_node(&mut self) {
        self.node_ends.push(self.children.len() as u32);
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.node_ends.len()
    }

    /// The children of a node.
    pub fn node(&self, i: usize) -> &[Child] {
        &self.children[self.child_range(i)]
    }

    fn child_range(&self, i: usize) -> Range<usize> {
        let start = if i == 0 { 0 } else { self.node_ends[i - 1] };
        start as usize..self.node_ends[i] as usize
    }

    /// Sorts the children of each node by descending priority for shadow rays, and returns the nodes' costs.
    pub fn sort_children_and_compute_costs(&mut self, leaf_costs: &[OcclusionCost]) -> Vec<OcclusionCost> {
        let mut node_costs = vec![OcclusionCost::default(); self.node_count()];
        for i in (0..self.node_count()).rev() {
            let range = self.child_range(i);
            let children = &mut self.children[range];
            let mut keys = [(0.0, 0); WIDTH];
            let mut unsorted = [children[0]; WIDTH];
            let keys = &mut keys[..children.len()];
            for (slot, (child, key)) in children.iter().zip(keys.iter_mut()).enumerate() {
                *key = (child.occlusion_cost(leaf_costs, &node_costs).priority(), slot);
                unsorted[slot] = *child;
            }
            keys.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            children.iter_mut().zip(keys).for_each(|(child, (_, slot))| *child = unsorted[*slot]);
            let bounds = Aabb::union_of(children.iter().map(Child::bounds));
            let costs =
                children.iter().map(|child| (child.bounds(), child.occlusion_cost(leaf_costs, &node_costs)));
            node_costs[i] = OcclusionCost::of_node(bounds, costs);
        }
        node_costs
    }

    /// Indices of the boxes of a leaf.
    pub fn leaf(&self, i: usize) -> &[u32] {
        let start = if i == 0 { 0 } else { self.leaf_ends[i - 1] };
        &self.boxes[start as usize..self.leaf_ends[i] as usize]
    }

    /// Indices of the boxes of each leaf.
    pub fn leaves(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        (0..self.leaf_ends.len()).map(|i| self.leaf(i))
    }

    /// Frees the leaves and unused capacity.
    pub fn drop_leaves(&mut self) {
        self.boxes = Vec::new();
        self.leaf_ends = Vec::new();
        self.children.shrink_to_fit();
        self.node_ends.shrink_to_fit();
    }
}
