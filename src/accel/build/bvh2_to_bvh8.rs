//! Which nodes of a binary tree become wide ones.
//!
//! It is decided by dynamic programming over expected costs (a box is met in proportion to its
//! surface): for each binary node the cheapest forest of up to 1…7 wide children that covers it
//! (Ylitie, Karras and Laine, Efficient Incoherent Ray Traversal on GPUs Through Compressed Bvh8 BVHs,
//! 2017, section 3.3).
//!
//! Nothing here recurses: trees may be as deep as they have entries.

use std::ops::Range;

use obvhs::aabb::Aabb as ObvhsAabb;
use obvhs::bvh2::Bvh2;

use crate::accel::build::leaf_packing::{Capacity, Leaf, Shape, Siblings};
use crate::accel::build::occlusion_order::OcclusionCost;
use crate::accel::bvh::aabb::Aabb;
use crate::accel::bvh::bvh8::WIDTH;

/// A leaf of more than one block may cost so many times what a node costs that has the same in it: it weighs less.
const LARGE_LEAF: f32 = 1.3;

/// Of at most how many roots the cheapest forest of a node has how many, and how many of those are
/// under its first child.
#[derive(Clone, Copy)]
struct Choice(u8);

impl Choice {
    const ONE: Choice = Choice::new(1, 0);

    const fn new(roots: usize, first: usize) -> Choice {
        Choice((roots << 4 | first) as u8)
    }

    fn roots(self) -> usize {
        usize::from(self.0 >> 4)
    }

    fn first(self) -> usize {
        usize::from(self.0 & 15)
    }
}

/// A node.
#[derive(Clone, Copy)]
struct Own {
    /// Its index in the binary tree.
    node: u32,
    /// Where its second child is; the first comes next after itself. 0 for a leaf of the binary tree.
    second: u32,
    /// Entries under it.
    entries: u32,
    /// True where all under it is one leaf, if it stands for that at all.
    leaf: bool,
    /// choices[i]: for at most i + 1 roots. The last says how a wide node is made of it.
    choices: [Choice; WIDTH],
}

/// costs[i]: of at most i + 1 roots.
type Costs = [f32; WIDTH - 1];

/// What becomes of a binary tree over boxes.
pub(crate) struct Forest<'a, E> {
    built: &'a Bvh2,
    boxes: &'a [ObvhsAabb],
    /// How many entries a box holds.
    entries: E,
    capacity: Capacity,
    /// Parents before children.
    nodes: Vec<Own>,
}

/// A child of a wide node, by its number among those of the same [`Grown`].
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

    /// Its odds, of those of all leaves and nodes.
    pub fn odds(&self, leaves: &[OcclusionCost], nodes: &[OcclusionCost]) -> OcclusionCost {
        match *self {
            Child::Leaf(_, leaf) => leaves[leaf as usize],
            Child::Node(_, node) => nodes[node as usize],
        }
    }
}

/// Bvh8 nodes and leaves, parents before children.
#[derive(Default)]
pub(crate) struct Grown {
    /// The children of all wide nodes, one node after the other, and where each node's end.
    children: Vec<Child>,
    ends: Vec<u32>,
    /// What is in the leaves, one after the other, and where each leaf's ends.
    members: Vec<u32>,
    leaves: Vec<u32>,
}

impl Grown {
    /// Adds a leaf of these members, whose box this is.
    pub fn add_leaf(&mut self, members: impl IntoIterator<Item = u32>, bounds: Aabb) -> Child {
        self.members.extend(members);
        self.leaves.push(self.members.len() as u32);
        Child::Leaf(bounds, self.leaves.len() as u32 - 1)
    }

    /// Number of wide nodes.
    pub fn nodes(&self) -> usize {
        self.ends.len()
    }

    /// The children of a wide node.
    pub fn node(&self, i: usize) -> &[Child] {
        &self.children[self.range(i)]
    }

    fn range(&self, i: usize) -> Range<usize> {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        start as usize..self.ends[i] as usize
    }

    /// Puts the children of each wide node in the order in which rays that ask for any hit ask them, and
    /// returns the nodes' odds.
    pub fn arrange(&mut self, leaves: &[OcclusionCost]) -> Vec<OcclusionCost> {
        let mut nodes = vec![OcclusionCost::default(); self.nodes()];
        for i in (0..self.nodes()).rev() {
            let range = self.range(i);
            let children = &mut self.children[range];
            let (mut order, mut before) = ([(0.0, 0); WIDTH], [children[0]; WIDTH]);
            let order = &mut order[..children.len()];
            for (slot, (child, key)) in children.iter().zip(order.iter_mut()).enumerate() {
                *key = (child.odds(leaves, &nodes).worth(), slot);
                before[slot] = *child;
            }
            order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            children.iter_mut().zip(order).for_each(|(child, (_, slot))| *child = before[*slot]);
            let known = children.iter().map(|child| (child.bounds(), child.odds(leaves, &nodes)));
            nodes[i] = OcclusionCost::of_all(Aabb::union_of(children.iter().map(Child::bounds)), known);
        }
        nodes
    }

    /// What is in a leaf.
    pub fn leaf(&self, i: usize) -> &[u32] {
        let start = if i == 0 { 0 } else { self.leaves[i - 1] };
        &self.members[start as usize..self.leaves[i] as usize]
    }

    /// Forgets what is in the leaves, and what room there was for more.
    pub fn keep_nodes(&mut self) {
        (self.members, self.leaves) = (Vec::new(), Vec::new());
        self.children.shrink_to_fit();
        self.ends.shrink_to_fit();
    }

    /// What is in each leaf.
    pub fn leaves(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        (0..self.leaves.len()).map(|i| self.leaf(i))
    }
}

impl<'a, E: Fn(u32) -> u32> Forest<'a, E> {
    /// Decides on all of a tree: box i holds `entries(i)`.
    pub fn new(built: &'a Bvh2, boxes: &'a [ObvhsAabb], entries: E, capacity: Capacity) -> Forest<'a, E> {
        let mut forest = Forest { built, boxes, entries, capacity, nodes: order(built) };
        let mut costs = vec![Costs::default(); forest.nodes.len()];
        for i in (0..forest.nodes.len()).rev() {
            costs[i] = forest.decide(i, &costs);
        }
        forest
    }

    /// Fills in node `i`, whose children's costs are known, and returns its own.
    fn decide(&mut self, i: usize, costs: &[Costs]) -> Costs {
        let Own { node, second, .. } = self.nodes[i];
        let binary = &self.built.nodes[node as usize];
        let (a, b) = (i + 1, second as usize);
        let entries = match second {
            0 => (self.entries)(self.built.primitive_indices[binary.first_index as usize]),
            _ => self.nodes[a].entries.saturating_add(self.nodes[b].entries),
        };
        self.nodes[i].entries = entries;
        let as_leaf = Shape::new(*binary.aabb(), entries).cost;
        if second == 0 || entries <= self.capacity.block {
            self.nodes[i].leaf = true;
            return [as_leaf; WIDTH - 1];
        }
        // Two roots and more; then one, which is a wide node over the best eight or fewer, or one leaf. Where
        // costs are infinite, its two children do.
        let (mut best, mut choice) = ([f32::INFINITY; WIDTH], [Choice::new(2, 1); WIDTH]);
        for roots in 2..=WIDTH {
            (best[roots - 1], choice[roots - 1]) = (best[roots - 2], choice[roots - 2]);
            for first in 1..roots {
                let sum = costs[a][first - 1] + costs[b][roots - first - 1];
                if sum < best[roots - 1] {
                    (best[roots - 1], choice[roots - 1]) = (sum, Choice::new(roots, first));
                }
            }
        }
        let as_node = best[WIDTH - 1] + binary.aabb().half_area();
        let leaf = entries <= self.capacity.leaf && as_leaf <= LARGE_LEAF * as_node;
        let whole = if leaf { as_leaf } else { as_node };
        let mut own = Costs::default();
        for roots in 1..WIDTH {
            if whole <= best[roots - 1] {
                (best[roots - 1], choice[roots - 1]) = (whole, Choice::ONE);
            }
            own[roots - 1] = best[roots - 1];
        }
        (self.nodes[i].choices, self.nodes[i].leaf) = (choice, leaf);
        own
    }

    /// Nodes that cover all of the tree: about `count`, the largest boxes replaced by what is in them.
    pub fn branches(&self, count: usize) -> Vec<usize> {
        let area = |&i: &usize| self.built.nodes[self.nodes[i].node as usize].aabb().half_area();
        let mut branches = vec![0];
        while branches.len() < count {
            let inner = (0..branches.len()).filter(|&b| !self.nodes[branches[b]].leaf);
            let Some(largest) = inner.max_by(|&a, &b| area(&branches[a]).total_cmp(&area(&branches[b])))
            else {
                break;
            };
            let i = branches[largest];
            branches[largest] = i + 1;
            branches.push(self.nodes[i].second as usize);
        }
        branches
    }

    /// Makes the wide nodes and leaves of all under node `i`, and says what stands for it.
    pub fn grow(&self, i: usize, grown: &mut Grown) -> Child {
        let first = grown.ends.len() as u32;
        if self.nodes[i].leaf {
            let leaf = self.leaf(i);
            return grown.add_leaf(leaf.boxes(), leaf.shape.bounds.into());
        }
        // Nodes that become wide ones, and where the numbers of all but the first go.
        let mut todo: Vec<(usize, Option<usize>)> = vec![(i, None)];
        let mut open: Vec<(usize, usize)> = Vec::new();
        while let Some((i, place)) = todo.pop() {
            let number = grown.ends.len() as u32;
            if let Some(Child::Node(_, own)) = place.map(|place| &mut grown.children[place]) {
                *own = number;
            }
            open.extend(self.split(i, self.nodes[i].choices[WIDTH - 1]));
            let mut siblings = Siblings::NONE;
            while let Some((i, count)) = open.pop() {
                let choice = self.nodes[i].choices[count - 1];
                if choice.roots() > 1 {
                    open.extend(self.split(i, choice));
                } else if self.nodes[i].leaf {
                    siblings.push(self.leaf(i));
                } else {
                    todo.push((i, Some(grown.children.len())));
                    grown.children.push(Child::Node(self.bounds(i), 0));
                }
            }
            siblings.share_out(self.capacity, |i| self.own(i));
            for leaf in siblings.leaves() {
                let child = grown.add_leaf(leaf.boxes(), leaf.shape.bounds.into());
                grown.children.push(child);
            }
            grown.ends.push(grown.children.len() as u32);
        }
        Child::Node(self.bounds(i), first)
    }

    /// Box `i`, and how many entries it has.
    fn own(&self, i: u32) -> (ObvhsAabb, u32) {
        (self.boxes[i as usize], (self.entries)(i))
    }

    /// A leaf of all under node `i`.
    fn leaf(&self, i: usize) -> Leaf {
        let mut leaf = Leaf::EMPTY;
        // Behind a node comes all that is under it.
        let mut open = 1;
        for own in &self.nodes[i..] {
            if own.second == 0 {
                let first = self.built.nodes[own.node as usize].first_index;
                let i = self.built.primitive_indices[first as usize];
                leaf.push(i, &self.own(i));
                open -= 1;
            } else {
                open += 1;
            }
            if open == 0 {
                break;
            }
        }
        leaf
    }

    /// The children of node `i`, the first one last, with the roots that each may have.
    fn split(&self, i: usize, choice: Choice) -> [(usize, usize); 2] {
        [(self.nodes[i].second as usize, choice.roots() - choice.first()), (i + 1, choice.first())]
    }

    fn bounds(&self, i: usize) -> Aabb {
        Aabb::from(*self.built.nodes[self.nodes[i].node as usize].aabb())
    }
}

/// All nodes, parents before children and each first child next after its parent.
fn order(built: &Bvh2) -> Vec<Own> {
    let mut nodes: Vec<Own> = Vec::with_capacity(built.nodes.len());
    // (a node, whose second child it is)
    let mut todo: Vec<(u32, Option<usize>)> = vec![(0, None)];
    while let Some((mut node, mut parent)) = todo.pop() {
        loop {
            let i = nodes.len();
            if let Some(parent) = parent.take() {
                nodes[parent].second = i as u32;
            }
            nodes.push(Own { node, second: 0, entries: 0, leaf: false, choices: [Choice::ONE; WIDTH] });
            let binary = &built.nodes[node as usize];
            if binary.is_leaf() {
                break;
            }
            todo.push((binary.first_index + 1, Some(i)));
            node = binary.first_index;
        }
    }
    nodes
}
