//! Converts a binary BVH (BVH2) to an eight-wide one by the surface area heuristic (SAH): which binary nodes become wide
//! nodes and which become leaves.
//!
//! Dynamic programming minimises the expected cost: for each binary node it finds the cheapest forest of up
//! to 1…7 wide subtrees that covers it (Ylitie, Karras and Laine, Efficient Incoherent Ray Traversal on GPUs Through
//! Compressed Wide BVHs, 2017, section 3.3).
//!
//! Nothing here recurses: a tree may be as deep as it has entries.

use obvhs::aabb::Aabb as ObvhsAabb;
use obvhs::bvh2::Bvh2;

use crate::build::leaf_groups::LeafGroups;
use crate::build::leaf_packing::{EntryBox, Leaf, LeafCapacity, LeafShape, SiblingLeaves};
use crate::build::subtree::{Child, Subtree};
use crate::bvh::aabb::Aabb;
use crate::bvh::bvh8::WIDTH;
use blinn_core::simd::{AutovecKernel, SimdLevel};

/// A leaf of several blocks is accepted up to this multiple of a node's cost, because it takes less memory.
const LARGE_LEAF_FACTOR: f32 = 1.3;

/// The cheapest forest of at most n roots: how many roots it has, and how many of those are in the first child.
#[derive(Clone, Copy)]
struct Choice(u8);

impl Choice {
    const ONE: Choice = Choice::new(1, 0);

    const fn new(roots: usize, in_first: usize) -> Choice {
        Choice((roots << 4 | in_first) as u8)
    }

    fn roots(self) -> usize {
        usize::from(self.0 >> 4)
    }

    fn in_first(self) -> usize {
        usize::from(self.0 & 15)
    }
}

/// A binary node with the decisions about it.
#[derive(Clone, Copy)]
struct BinaryNode {
    /// Index in the binary tree.
    node: u32,
    /// Position of the second child; the first one follows its parent. 0 for a leaf of the binary tree.
    second: u32,
    /// Entries in the subtree.
    entries: u32,
    /// True if the subtree becomes a leaf if it is a root.
    is_leaf: bool,
    /// `choices[i]`: the forest of at most i + 1 roots. The last one makes the children of a wide node.
    choices: [Choice; WIDTH],
}

/// `costs[i]`: the cost of the cheapest forest of at most i + 1 roots.
type Costs = [f32; WIDTH - 1];

/// Converts a binary BVH over groups of boxes.
pub(crate) struct WideConverter<'a, E> {
    bvh2: &'a Bvh2,
    groups: &'a LeafGroups,
    boxes: &'a [ObvhsAabb],
    /// Number of entries in a box.
    entry_count: E,
    capacity: LeafCapacity,
    /// Preorder: parents before children.
    nodes: Vec<BinaryNode>,
}

impl<'a, E: Fn(u32) -> u32> WideConverter<'a, E> {
    /// Decides about all nodes of a tree over `groups` of boxes, of which box i holds `entry_count(i)` entries.
    pub fn new(
        bvh2: &'a Bvh2,
        groups: &'a LeafGroups,
        boxes: &'a [ObvhsAabb],
        entry_count: E,
        capacity: LeafCapacity,
    ) -> WideConverter<'a, E> {
        let mut converter =
            WideConverter { bvh2, groups, boxes, entry_count, capacity, nodes: preorder(bvh2) };
        let mut costs = vec![Costs::default(); converter.nodes.len()];
        SimdLevel::detect().run(ChooseForests { converter: &mut converter, costs: &mut costs });
        converter
    }

    /// Decides about node `i`, whose children's costs are known, and returns its own.
    #[inline(always)]
    fn choose(&mut self, i: usize, costs: &[Costs]) -> Costs {
        let BinaryNode { node, second, .. } = self.nodes[i];
        let binary = &self.bvh2.nodes[node as usize];
        let first = i + 1;
        let second = second as usize;
        let entries = match second {
            0 => self.groups.entry_count(self.group(binary.first_index)),
            _ => self.nodes[first].entries.saturating_add(self.nodes[second].entries),
        };
        self.nodes[i].entries = entries;
        let leaf_cost = LeafShape::new(*binary.aabb(), entries).cost;
        if second == 0 || entries <= self.capacity.entries_per_block {
            self.nodes[i].is_leaf = true;
            return [leaf_cost; WIDTH - 1];
        }
        let forests = Forests::new(&costs[first], &costs[second]);
        let node_cost = forests.best[WIDTH - 1] + binary.aabb().half_area();
        let is_leaf = entries <= self.capacity.entries_per_leaf && leaf_cost <= LARGE_LEAF_FACTOR * node_cost;
        let single_root_cost = if is_leaf { leaf_cost } else { node_cost };
        self.nodes[i].is_leaf = is_leaf;
        self.nodes[i].choices = forests.choices(single_root_cost);
        std::array::from_fn(|roots| forests.best[roots].min(single_root_cost))
    }

    /// Returns about `count` nodes that cover the whole tree, by replacing the node with the largest box by its
    /// children again and again.
    pub fn branches(&self, count: usize) -> Vec<usize> {
        let area = |&i: &usize| self.bvh2.nodes[self.nodes[i].node as usize].aabb().half_area();
        let mut branches = vec![0];
        while branches.len() < count {
            let inner = (0..branches.len()).filter(|&b| !self.nodes[branches[b]].is_leaf);
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

    /// Adds the wide nodes and leaves below node `i` to `out` and returns their root.
    pub fn convert(&self, i: usize, out: &mut Subtree) -> Child {
        let root = out.node_count() as u32;
        if self.nodes[i].is_leaf {
            let leaf = self.leaf(i);
            return out.add_leaf(leaf.boxes(), leaf.shape.bounds.into());
        }
        let mut work = RemainingWork::default();
        work.nodes.push(NodeToConvert { node: i, reference: None });
        while let Some(NodeToConvert { node, reference }) = work.nodes.pop() {
            if let Some(reference) = reference {
                out.resolve(reference);
            }
            self.convert_node(node, out, &mut work);
        }
        Child::Node(self.bounds(i), root)
    }

    /// Adds one wide node with its leaves; its inner children are added to `work`.
    fn convert_node(&self, i: usize, out: &mut Subtree, work: &mut RemainingWork) {
        work.forests.extend(self.split(i, self.nodes[i].choices[WIDTH - 1]));
        work.siblings.clear();
        while let Some(ForestToSplit { node, max_roots }) = work.forests.pop() {
            let choice = self.nodes[node].choices[max_roots - 1];
            if choice.roots() > 1 {
                work.forests.extend(self.split(node, choice));
            } else if self.nodes[node].is_leaf {
                work.siblings.push(self.leaf(node));
            } else {
                let reference = Some(out.add_unresolved(self.bounds(node)));
                work.nodes.push(NodeToConvert { node, reference });
            }
        }
        work.siblings.repack(self.capacity, |i| self.entry_box(i));
        for leaf in work.siblings.leaves() {
            let child = out.add_leaf(leaf.boxes(), leaf.shape.bounds.into());
            out.add_child(child);
        }
        out.end_node();
    }

    /// Box `i` and its number of entries.
    fn entry_box(&self, i: u32) -> EntryBox {
        EntryBox { bounds: self.boxes[i as usize], entries: (self.entry_count)(i) }
    }

    /// The group at a position of the binary tree's indices.
    #[inline(always)]
    fn group(&self, position: u32) -> u32 {
        self.bvh2.primitive_indices[position as usize]
    }

    /// Returns a leaf of all boxes below node `i`.
    fn leaf(&self, i: usize) -> Leaf {
        let bounds = *self.bvh2.nodes[self.nodes[i].node as usize].aabb();
        let mut leaf = Leaf::new(LeafShape::new(bounds, self.nodes[i].entries));
        // A node's subtree follows it: it ends where no child is open.
        let mut open = 1;
        for own in &self.nodes[i..] {
            if own.second == 0 {
                let group = self.group(self.bvh2.nodes[own.node as usize].first_index);
                leaf.extend(self.groups.members(group));
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

    /// The forests of node `i`'s children, the first child last.
    fn split(&self, i: usize, choice: Choice) -> [ForestToSplit; 2] {
        let second = self.nodes[i].second as usize;
        [
            ForestToSplit { node: second, max_roots: choice.roots() - choice.in_first() },
            ForestToSplit { node: i + 1, max_roots: choice.in_first() },
        ]
    }

    fn bounds(&self, i: usize) -> Aabb {
        Aabb::from(*self.bvh2.nodes[self.nodes[i].node as usize].aabb())
    }
}

/// The decisions about all nodes, children before parents. They are the same at every SIMD level.
struct ChooseForests<'a, 'b, E> {
    converter: &'a mut WideConverter<'b, E>,
    costs: &'a mut [Costs],
}

impl<E: Fn(u32) -> u32> AutovecKernel for ChooseForests<'_, '_, E> {
    #[inline(always)]
    fn run(self) {
        for i in (0..self.costs.len()).rev() {
            self.costs[i] = self.converter.choose(i, self.costs);
        }
    }
}

/// The remaining work of a conversion.
#[derive(Default)]
struct RemainingWork {
    /// Nodes that become wide ones.
    nodes: Vec<NodeToConvert>,
    /// Forests whose roots become children of the current wide node.
    forests: Vec<ForestToSplit>,
    /// Leaves of the current wide node.
    siblings: SiblingLeaves,
}

struct NodeToConvert {
    node: usize,
    /// The reference that takes its number; the root has none.
    reference: Option<usize>,
}

struct ForestToSplit {
    node: usize,
    max_roots: usize,
}

/// The cheapest forests of two or more roots below a node: `best[i]` is the cost of that of at most i + 1 roots, of which
/// at most `in_first[i]` are in the first child.
struct Forests {
    best: [f32; WIDTH],
    in_first: [u32; WIDTH],
}

impl Forests {
    /// Combines the forests of two children. Where costs are infinite, the first child has one root.
    #[inline(always)]
    fn new(first: &Costs, second: &Costs) -> Forests {
        let mut forests = Forests { best: [f32::INFINITY; WIDTH], in_first: [1; WIDTH] };
        let mut costs = [f32::INFINITY; 2 * WIDTH - 1];
        costs[WIDTH..].copy_from_slice(second);
        for in_first in 1..WIDTH {
            // `in_first` roots are in the first child, the rest of `roots` in the second.
            let cost = first[in_first - 1];
            let rest = &costs[WIDTH - in_first..][..WIDTH];
            for roots in 0..WIDTH {
                let sum = cost + rest[roots];
                let is_less = sum < forests.best[roots];
                forests.best[roots] = if is_less { sum } else { forests.best[roots] };
                forests.in_first[roots] = if is_less { in_first as u32 } else { forests.in_first[roots] };
            }
        }
        forests
    }

    /// The choices at a node that costs `single_root_cost` as the only root.
    #[inline(always)]
    fn choices(&self, single_root_cost: f32) -> [Choice; WIDTH] {
        std::array::from_fn(|i| {
            // The last choice makes the children of a wide node.
            if i + 1 < WIDTH && single_root_cost <= self.best[i] {
                Choice::ONE
            } else {
                Choice::new(i + 1, self.in_first[i] as usize)
            }
        })
    }
}

/// Returns all nodes in preorder.
fn preorder(bvh2: &Bvh2) -> Vec<BinaryNode> {
    let mut nodes: Vec<BinaryNode> = Vec::with_capacity(bvh2.nodes.len());
    // A node, and the position of the parent whose second child it is.
    let mut stack: Vec<(u32, Option<usize>)> = vec![(0, None)];
    while let Some((mut node, mut parent)) = stack.pop() {
        loop {
            let i = nodes.len();
            if let Some(parent) = parent.take() {
                nodes[parent].second = i as u32;
            }
            nodes.push(BinaryNode {
                node,
                second: 0,
                entries: 0,
                is_leaf: false,
                choices: [Choice::ONE; WIDTH],
            });
            let binary = &bvh2.nodes[node as usize];
            if binary.is_leaf() {
                break;
            }
            stack.push((binary.first_index + 1, Some(i)));
            node = binary.first_index;
        }
    }
    nodes
}
