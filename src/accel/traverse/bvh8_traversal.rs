//! BVH traversal: front to back for closest hits, by occlusion priority for any hit.
//!
//! These two loops serve all queries that are not ray packets: single rays in BLAS and TLAS, traversal statistics and
//! frustum culling. What they do with nodes and leaves is the node test's and the leaf visitor's part.

use crate::bvh::bvh8::{Bvh8, Bvh8Node, LEAF_BIT, WIDTH};
use crate::traverse::box_test::{NodeTest, OrderedNodeTest};

/// The nodes and leaves that a ray has yet to visit. One serves a whole batch, ray after ray; traversals nest
/// (TLAS, then BLAS).
#[derive(Clone, Debug)]
pub(crate) struct TraversalStack {
    /// Children to visit; in any-hit traversal a node and the mask of its remaining children by turns.
    words: Vec<u32>,
    /// Distances at which the ray enters the children; unused in any-hit traversal.
    near: Vec<f32>,
    /// Words in use. A traversal updates it only around leaves, where another one may nest.
    len: usize,
}

impl Default for TraversalStack {
    fn default() -> Self {
        TraversalStack { words: vec![0; 256], near: vec![0.0; 256], len: 0 }
    }
}

impl TraversalStack {
    /// Returns room for eight more words behind the first `len`.
    #[inline(always)]
    pub fn room(&mut self, len: usize) -> (&mut [f32; WIDTH], &mut [u32; WIDTH]) {
        if len + WIDTH > self.words.len() {
            self.grow(len);
        }
        let range = len..len + WIDTH;
        // The ranges have that length: this cannot fail.
        let near = self.near[range.clone()].first_chunk_mut();
        let words = self.words[range].first_chunk_mut();
        match (near, words) {
            (Some(near), Some(words)) => (near, words),
            _ => unreachable!("ranges have their length"),
        }
    }

    /// The child at a place of the stack and the distance at which the ray enters it.
    #[inline(always)]
    pub fn child(&self, place: usize) -> Option<(u32, f32)> {
        Some((*self.words.get(place)?, *self.near.get(place)?))
    }

    /// The last two of the first `len` words.
    #[inline(always)]
    pub fn last_two(&mut self, len: usize) -> Option<&mut [u32; 2]> {
        self.words.get_mut(..len)?.last_chunk_mut()
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, len: usize) {
        let size = 2 * (len + WIDTH);
        self.words.resize(size, 0);
        self.near.resize(size, 0.0);
    }
}

/// Intersects a ray with the contents of leaves.
pub(crate) trait LeafVisitor {
    /// Visits leaf number `leaf`, whose box the ray enters. Returns the new limit on entry distances, or `None` to
    /// end the traversal.
    fn visit_leaf(&mut self, leaf: u32, stack: &mut TraversalStack) -> Option<f32>;
}

impl Bvh8 {
    /// Closest-hit traversal below `root`: visits children front to back and skips those that the ray enters
    /// beyond `limit`. Returns false if `leaves` ended it.
    #[inline(always)]
    pub fn traverse_closest(
        &self,
        root: u32,
        test: &impl OrderedNodeTest,
        stack: &mut TraversalStack,
        mut limit: f32,
        leaves: &mut impl LeafVisitor,
    ) -> bool {
        // A local, so that it stays in a register.
        let base = stack.len;
        let mut top = base;
        let nodes: &[Bvh8Node] = &self.nodes;
        let mut current = root;
        loop {
            if current & LEAF_BIT == 0 {
                let node = &nodes[current as usize];
                let (near, child) = stack.room(top);
                let (count, nearest) = test.sort_hit_children(node, limit, near, child);
                if count > 0 {
                    top += count - 1;
                    current = nearest;
                    continue;
                }
            } else {
                stack.len = top;
                match leaves.visit_leaf(current & !LEAF_BIT, stack) {
                    Some(new_limit) => limit = new_limit,
                    None => {
                        stack.len = base;
                        return false;
                    }
                }
            }
            loop {
                stack.len = base;
                if top == base {
                    return true;
                }
                top -= 1;
                let (Some(&next), Some(&near)) = (stack.words.get(top), stack.near.get(top)) else {
                    return true;
                };
                if near <= limit {
                    current = next;
                    break;
                }
            }
        }
    }

    /// Any-hit traversal below `root`, for shadow rays up to `limit`: visits children in the order of their
    /// slots, which is that of their occlusion priority. Returns false if `leaves` ended it.
    ///
    /// It is a loop of its own because it pushes a node with the mask of its remaining children, where
    /// [`Bvh8::traverse_closest`] sorts and pushes children: 2 words for each level instead of up to 14.
    #[inline(always)]
    pub fn traverse_any(
        &self,
        root: u32,
        test: &impl NodeTest,
        stack: &mut TraversalStack,
        limit: f32,
        leaves: &mut impl LeafVisitor,
    ) -> bool {
        let base = stack.len;
        let mut top = base;
        let nodes: &[Bvh8Node] = &self.nodes;
        let mut current = root;
        loop {
            if current & LEAF_BIT == 0 {
                let node = &nodes[current as usize];
                let hits = test.hit_mask(node, limit);
                if hits != 0 {
                    let remaining = hits & (hits - 1);
                    let (_, words) = stack.room(top);
                    words[0] = current;
                    words[1] = remaining;
                    top += if remaining == 0 { 0 } else { 2 };
                    current = node.child[hits.trailing_zeros() as usize & (WIDTH - 1)];
                    continue;
                }
            } else {
                stack.len = top;
                let goes_on = leaves.visit_leaf(current & !LEAF_BIT, stack).is_some();
                stack.len = base;
                if !goes_on {
                    return false;
                }
            }
            if top == base {
                return true;
            }
            let Some([node, remaining]) = stack.words[..top].last_chunk_mut() else { return true };
            current = nodes[*node as usize].child[remaining.trailing_zeros() as usize & (WIDTH - 1)];
            *remaining &= *remaining - 1;
            top -= if *remaining == 0 { 2 } else { 0 };
        }
    }
}
