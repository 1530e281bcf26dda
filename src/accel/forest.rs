//! Which nodes of a binary tree become wide ones.
//!
//! It is decided by dynamic programming over expected costs (a box is met in proportion to its
//! surface): for each binary node the cheapest forest of up to 1…7 wide children that covers it
//! (Ylitie, Karras and Laine, Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs,
//! 2017, section 3.3).
//!
//! The tree is cut into parts below its top. Each part is decided, and later collapsed, on its own, in
//! an order of its own where what belongs together lies together. Nothing here recurses: trees may be
//! as deep as they have entries.

use std::collections::{HashMap, VecDeque};

use obvhs::bvh2::Bvh2;

use super::wide::{Box3, WIDTH};

/// Cost of visiting a node, in units of what a leaf costs besides its entries.
const NODE_COST: f32 = 1.0;
/// Cost of a leaf: so much, and so much for each entry.
const LEAF_COST: f32 = 0.6;
const ENTRY_COST: f32 = 0.2;

/// What each leaf of a binary tree holds, and how much of it a leaf of a wide one may.
pub(super) struct Leaves<F> {
    /// Entries in the box of an index.
    pub sizes: F,
    pub capacity: u32,
}

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

/// A node of a part.
#[derive(Clone, Copy)]
struct Own {
    /// Its index in the binary tree.
    node: u32,
    /// Where in the part its second child is; the first comes next after itself. 0 for a leaf of
    /// the binary tree, [`PART`] and a number for one where a part begins.
    second: u32,
    /// Entries under it.
    entries: u32,
    /// choices[i]: for at most i + 1 roots. The last says how a wide node is made of it.
    choices: [Choice; WIDTH],
}

/// Marks the number of a part.
const PART: u32 = 1 << 31;

/// costs[i]: of at most i + 1 roots.
type Costs = [f32; WIDTH - 1];

/// A part of a binary tree.
pub(super) struct Part {
    nodes: Vec<Own>,
    /// Costs of its root.
    costs: Costs,
}

/// A child of a wide node.
#[derive(Clone, Copy)]
pub(super) enum Child {
    /// A leaf of the same part.
    Leaf(Box3, u32),
    /// A wide node of the same part.
    Node(Box3, u32),
    /// The roots of another part's forest.
    Part(u32),
}

/// The wide nodes and leaves of a part, parents before children.
#[derive(Default)]
pub(super) struct Grown {
    /// What covers all of it.
    pub roots: Vec<Child>,
    /// The children of all wide nodes, one node after the other, and where each node's begin and the
    /// last's end.
    pub children: Vec<Child>,
    pub starts: Vec<usize>,
    /// What is in the leaves, one after the other, and where each leaf's ends.
    pub members: Vec<u32>,
    pub ends: Vec<u32>,
    /// Of each part that begins in this one, how many roots its forest may have: by its number.
    pub asked: Vec<(u32, usize)>,
}

impl Grown {
    /// Of a part that is nowhere needed: it lies in a leaf.
    pub fn none() -> Grown {
        Grown { starts: vec![0], ..Grown::default() }
    }

    /// Number of wide nodes.
    pub fn nodes(&self) -> usize {
        self.starts.len() - 1
    }
}

/// The nodes where a tree is cut into parts: about `count` of them, none in a small tree.
pub(super) fn cut(built: &Bvh2, count: usize) -> Vec<u32> {
    if count < 2 || built.nodes.len() < 256 * count {
        return Vec::new();
    }
    let mut border = VecDeque::from([0u32]);
    let mut leaves = 0;
    while border.len() < count && leaves < border.len() {
        let Some(i) = border.pop_front() else { break };
        let node = &built.nodes[i as usize];
        if node.is_leaf() {
            border.push_back(i);
            leaves += 1;
        } else {
            border.extend([node.first_index, node.first_index + 1]);
            leaves = 0;
        }
    }
    border.into()
}

impl Part {
    /// Decides on the part of a tree under `root`, down to where the parts `below` begin: for each
    /// its root and itself.
    pub fn plan<F: Fn(u32) -> u32>(
        built: &Bvh2,
        root: u32,
        below: &[(u32, Part)],
        leaves: &Leaves<F>,
    ) -> Part {
        let mut part = Part { nodes: order(built, root, below), costs: Costs::default() };
        let mut costs = vec![Costs::default(); part.nodes.len()];
        for i in (0..part.nodes.len()).rev() {
            costs[i] = part.decide(i, built, &costs, below, leaves);
        }
        part.costs = costs.first().copied().unwrap_or_default();
        part
    }

    /// Fills in node `i`, whose children's costs are known, and returns its own.
    fn decide<F: Fn(u32) -> u32>(
        &mut self,
        i: usize,
        built: &Bvh2,
        costs: &[Costs],
        below: &[(u32, Part)],
        leaves: &Leaves<F>,
    ) -> Costs {
        let Own { node, second, .. } = self.nodes[i];
        if second & PART != 0 {
            let part = &below[(second & !PART) as usize].1;
            self.nodes[i].entries = part.nodes.first().map_or(0, |root| root.entries);
            return part.costs;
        }
        let binary = &built.nodes[node as usize];
        let (a, b) = (i + 1, second as usize);
        let entries = match second {
            0 => (leaves.sizes)(built.primitive_indices[binary.first_index as usize]),
            _ => self.nodes[a].entries.saturating_add(self.nodes[b].entries),
        };
        self.nodes[i].entries = entries;
        let area = half_area(binary.aabb());
        if second == 0 || entries <= leaves.capacity {
            return [area * (LEAF_COST + ENTRY_COST * entries as f32); WIDTH - 1];
        }
        // Two roots and more; then one, which is a wide node over the best eight or fewer. Where costs
        // are infinite, its two children do.
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
        let whole = best[WIDTH - 1] + area * NODE_COST;
        let mut own = Costs::default();
        for roots in 1..WIDTH {
            if whole <= best[roots - 1] {
                (best[roots - 1], choice[roots - 1]) = (whole, Choice::ONE);
            }
            own[roots - 1] = best[roots - 1];
        }
        self.nodes[i].choices = choice;
        own
    }

    /// Makes the wide nodes and leaves of its forest of at most `roots` roots.
    pub fn grow(&self, built: &Bvh2, roots: usize, below: &[(u32, Part)], capacity: u32) -> Grown {
        let mut grown = Grown::default();
        // (a node that becomes a wide one, where its number goes)
        let mut todo: Vec<(usize, Place)> = Vec::new();
        let mut open: Vec<(usize, usize)> = vec![(0, roots)];
        let mut in_node = false;
        loop {
            while let Some((i, count)) = open.pop() {
                let own = &self.nodes[i];
                let choice = own.choices[count - 1];
                let child = if own.second & PART != 0 {
                    let part = own.second & !PART;
                    grown.asked.push((part, count));
                    Child::Part(part)
                } else if own.second == 0 || own.entries <= capacity {
                    Child::Leaf(bounds(built, own.node), self.leaf(i, built, below, &mut grown))
                } else if choice.roots() > 1 {
                    open.extend(split(i, own, choice));
                    continue;
                } else {
                    let place = match in_node {
                        false => Place::Root(grown.roots.len()),
                        true => Place::Child(grown.children.len()),
                    };
                    todo.push((i, place));
                    Child::Node(bounds(built, own.node), 0)
                };
                match in_node {
                    false => grown.roots.push(child),
                    true => grown.children.push(child),
                }
            }
            let Some((i, place)) = todo.pop() else { break };
            let number = grown.starts.len() as u32;
            let child = match place {
                Place::Root(i) => &mut grown.roots[i],
                Place::Child(i) => &mut grown.children[i],
            };
            if let Child::Node(_, own) = child {
                *own = number;
            }
            grown.starts.push(grown.children.len());
            in_node = true;
            open.extend(split(i, &self.nodes[i], self.nodes[i].choices[WIDTH - 1]));
        }
        grown.starts.push(grown.children.len());
        grown
    }

    /// Makes a leaf of all under node `i`, and returns its number.
    fn leaf(&self, i: usize, built: &Bvh2, below: &[(u32, Part)], grown: &mut Grown) -> u32 {
        // Behind a node comes all that is under it.
        let mut open = 1;
        for own in &self.nodes[i..] {
            if own.second & PART != 0 {
                let part = &below[(own.second & !PART) as usize].1;
                grown.members.extend(part.nodes.iter().filter_map(|own| own.member(built)));
            } else {
                grown.members.extend(own.member(built));
            }
            let inner = own.second != 0 && own.second & PART == 0;
            open = if inner { open + 1 } else { open - 1 };
            if open == 0 {
                break;
            }
        }
        grown.ends.push(grown.members.len() as u32);
        grown.ends.len() as u32 - 1
    }
}

/// Where the number of a wide node goes.
enum Place {
    Root(usize),
    Child(usize),
}

impl Own {
    /// The box of a leaf of the binary tree.
    fn member(&self, built: &Bvh2) -> Option<u32> {
        let first = built.nodes[self.node as usize].first_index;
        (self.second == 0).then(|| built.primitive_indices[first as usize])
    }
}

/// The children of node `i`, the first one last, with the roots that each may have.
fn split(i: usize, own: &Own, choice: Choice) -> [(usize, usize); 2] {
    [(own.second as usize, choice.roots() - choice.first()), (i + 1, choice.first())]
}

/// The nodes of the part under `root`.
fn order(built: &Bvh2, root: u32, below: &[(u32, Part)]) -> Vec<Own> {
    let numbers: HashMap<u32, u32> =
        below.iter().zip(0..).map(|((root, _), number)| (*root, number)).collect();
    let mut nodes: Vec<Own> = Vec::new();
    // (a node, whose second child it is)
    let mut todo: Vec<(u32, Option<usize>)> = vec![(root, None)];
    while let Some((mut node, mut parent)) = todo.pop() {
        loop {
            let i = nodes.len();
            if let Some(parent) = parent.take() {
                nodes[parent].second = i as u32;
            }
            let number = if numbers.is_empty() { None } else { numbers.get(&node) };
            let second = number.map_or(0, |number| PART | number);
            nodes.push(Own { node, second, entries: 0, choices: [Choice::ONE; WIDTH] });
            let binary = &built.nodes[node as usize];
            if number.is_some() || binary.is_leaf() {
                break;
            }
            todo.push((binary.first_index + 1, Some(i)));
            node = binary.first_index;
        }
    }
    nodes
}

fn bounds(built: &Bvh2, node: u32) -> Box3 {
    let aabb = built.nodes[node as usize].aabb();
    (aabb.min.into(), aabb.max.into())
}

fn half_area(b: &obvhs::aabb::Aabb) -> f32 {
    let d = b.max - b.min;
    d.x * d.y + d.y * d.z + d.z * d.x
}
