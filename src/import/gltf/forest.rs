//! Turns the node graph of a file into a forest. The specification requires strict trees, but some files
//! list children as roots, or give nodes several parents or themselves as descendants.

use ::gltf::json::Root;

use super::graph::{Roots, SceneNode};
use crate::error::Warnings;

/// The nodes below `roots` in depth-first order, with children in the file's order. Each occurs once:
///
/// - A root that another node of the scene has as its child is below that node.
/// - A child of several nodes is below the first of them in depth-first order.
/// - A child that is an ancestor of its parent stays above it.
pub(super) fn nodes(root: &Root, roots: &Roots, warnings: &mut Warnings) -> Vec<SceneNode> {
    let count = root.nodes.len();
    let mut builder = Builder {
        root,
        places: vec![Place::Outside; count],
        is_open: vec![false; count],
        ignored: Ignored::default(),
    };
    let (first, rest) = match roots {
        Roots::Scene(nodes) => (nodes, &[][..]),
        Roots::File { roots, children } => (roots, &children[..]),
    };
    for &start in first {
        builder.add_root(start);
    }
    // Every node that is left is in or below a cycle.
    let child_roots = builder.ignored.child_roots.len();
    for &start in rest {
        if builder.places[start] == Place::Outside {
            builder.add_tree(start);
        }
    }
    builder.ignored.child_roots.truncate(child_roots);
    builder.ignored.warn(warnings);
    builder.in_order(first.iter().chain(rest).copied())
}

fn children(root: &Root, node: usize) -> &[::gltf::json::Index<::gltf::json::Node>] {
    root.nodes.get(node).and_then(|n| n.children.as_deref()).unwrap_or_default()
}

/// The place of a node in the forest.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    Outside,
    Root,
    Below(usize),
}

struct Builder<'r> {
    root: &'r Root,
    places: Vec<Place>,
    /// True for the node whose children are being added, and its ancestors.
    is_open: Vec<bool>,
    ignored: Ignored,
}

impl Builder<'_> {
    /// Adds a root of the scene and what is below it.
    fn add_root(&mut self, start: usize) {
        match self.places.get(start) {
            Some(Place::Outside) => self.add_tree(start),
            Some(Place::Root) => self.ignored.repeated.push(start),
            Some(Place::Below(_)) => self.ignored.child_roots.push(start),
            None => {}
        }
    }

    /// Adds a node outside of the forest as a root, and what is below it.
    fn add_tree(&mut self, start: usize) {
        self.places[start] = Place::Root;
        self.is_open[start] = true;
        // Open nodes, each with the position of its next child.
        let mut open: Vec<(usize, usize)> = vec![(start, 0)];
        while let Some((parent, next)) = open.last_mut() {
            let parent = *parent;
            let Some(child) = children(self.root, parent).get(*next).map(|child| child.value()) else {
                self.is_open[parent] = false;
                open.pop();
                continue;
            };
            *next += 1;
            if self.add_child(parent, child) {
                self.is_open[child] = true;
                open.push((child, 0));
            }
        }
    }

    /// Adds a child to an open node. Returns true if the child was not in the forest yet.
    fn add_child(&mut self, parent: usize, child: usize) -> bool {
        let Some(&place) = self.places.get(child) else { return false };
        match place {
            Place::Outside => {}
            _ if self.is_open[child] => {
                self.ignored.cycles.push(parent);
                return false;
            }
            Place::Root => self.ignored.child_roots.push(child),
            Place::Below(first) if first == parent => {
                self.ignored.repeated.push(child);
                return false;
            }
            Place::Below(_) => {
                self.ignored.shared.push(child);
                return false;
            }
        }
        self.places[child] = Place::Below(parent);
        place == Place::Outside
    }

    /// The nodes of the forest in depth-first order.
    fn in_order(&self, starts: impl DoubleEndedIterator<Item = usize>) -> Vec<SceneNode> {
        let is_root = |node: &usize| self.places.get(*node) == Some(&Place::Root);
        let mut stack: Vec<SceneNode> = starts
            .filter(is_root)
            .map(|node| SceneNode { node, parent: None, is_drawn: true })
            .rev()
            .collect();
        let mut is_listed = vec![false; self.places.len()];
        let mut out: Vec<SceneNode> = Vec::new();
        while let Some(next) = stack.pop() {
            if std::mem::replace(&mut is_listed[next.node], true) {
                continue;
            }
            let parent = Some(out.len() as u32);
            out.push(next);
            let is_below = |child: &usize| self.places.get(*child) == Some(&Place::Below(next.node));
            let below = children(self.root, next.node).iter().map(|child| child.value()).filter(is_below);
            stack.extend(below.rev().map(|node| SceneNode { node, parent, is_drawn: true }));
        }
        out
    }
}

/// Nodes with references that the forest leaves out.
#[derive(Debug, Default)]
struct Ignored {
    /// Nodes that `scene.nodes` lists although another node of the scene has them as children.
    child_roots: Vec<usize>,
    /// Nodes that `scene.nodes` or their parent lists more than once.
    repeated: Vec<usize>,
    /// Children of a second parent.
    shared: Vec<usize>,
    /// Nodes that have an ancestor as their child.
    cycles: Vec<usize>,
}

impl Ignored {
    /// Warns of each kind at its first node.
    fn warn(&mut self, warnings: &mut Warnings) {
        for (nodes, member, defect) in [
            (&mut self.child_roots, "", "are both roots and children; each is drawn once, below its parent"),
            (&mut self.repeated, "", "are listed more than once; each is drawn once"),
            (&mut self.shared, "", "have several parents; each is drawn once, below the first"),
            (&mut self.cycles, ".children", "have an ancestor as a child; ignored that child"),
        ] {
            if let Some(first) = sort(nodes) {
                let count = nodes.len();
                warnings.add(format_args!("nodes[{first}]{member}"), format_args!("{count} nodes {defect}"));
            }
        }
    }
}

/// Sorts nodes, removes repetitions, and returns the first.
fn sort(nodes: &mut Vec<usize>) -> Option<usize> {
    nodes.sort_unstable();
    nodes.dedup();
    nodes.first().copied()
}
