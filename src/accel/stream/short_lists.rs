//! The rays of short lists, which continue one by one, several of them by turns.
//!
//! Each turn takes a ray to one node or leaf and prefetches its next one. While that is on its way, other rays take their
//! turns.

use crate::bvh::bvh8::{Bvh8, Bvh8Node, LEAF_BIT, Octant, WIDTH};
use crate::stream::list_visitor::ListVisitor;
use crate::stream::node_test::NodePlanes;
use crate::stream::prepared_rays::{PreparedRays, STREAM_RAYS, boxed_array};
use crate::traverse::bvh8_traversal::TraversalStack;
use blinn_core::simd::{Lanes, OutlinedKernel, Simd, prefetch_all_lines};

/// Rays that take turns.
const TURNS: usize = 8;

/// So many waiting rays are traced before others are added.
const MAX_WAITING: usize = 48;

/// A ray and the node or leaf that it is to visit next.
#[derive(Clone, Copy, Debug, Default)]
struct Visit {
    ray: u32,
    child: u32,
}

/// The rays of short lists that are still to be traced.
#[derive(Debug)]
pub(super) struct ShortLists {
    waiting: Vec<Visit>,
    is_waiting: Box<[bool; STREAM_RAYS]>,
    stacks: [TraversalStack; TURNS],
}

impl Default for ShortLists {
    fn default() -> Self {
        ShortLists { waiting: Vec::new(), is_waiting: boxed_array(false), stacks: Default::default() }
    }
}

impl ShortLists {
    #[inline(always)]
    pub fn push(&mut self, ray: u32, child: u32) {
        self.waiting.push(Visit { ray, child });
        self.is_waiting[ray as usize & (STREAM_RAYS - 1)] = true;
    }

    /// Returns true if the ray is among those to be traced.
    #[inline(always)]
    pub fn is_waiting(&self, ray: u32) -> bool {
        self.is_waiting[ray as usize & (STREAM_RAYS - 1)]
    }

    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.waiting.len() >= MAX_WAITING
    }

    /// Traces all rays.
    #[inline(always)]
    pub fn trace_all<S: Simd, V: ListVisitor<S>>(
        &mut self,
        bvh: &Bvh8,
        prepared_rays: &mut PreparedRays,
        visitor: &mut V,
    ) {
        if !self.waiting.is_empty() {
            S::call_outlined(TurnsKernel { bvh, prepared_rays, short: self, visitor });
        }
    }
}

/// [`ShortLists::trace_all`] as a function of its own.
struct TurnsKernel<'a, V> {
    bvh: &'a Bvh8,
    prepared_rays: &'a mut PreparedRays,
    short: &'a mut ShortLists,
    visitor: &'a mut V,
}

impl<S: Simd, V: ListVisitor<S>> OutlinedKernel<S> for TurnsKernel<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let TurnsKernel { bvh, prepared_rays, short, visitor } = self;
        let ShortLists { waiting, is_waiting, stacks } = short;
        let nodes: &[Bvh8Node] = &bvh.nodes;
        let prefetch = |visitor: &V, child: u32| {
            if child & LEAF_BIT != 0 {
                visitor.prefetch(child & !LEAF_BIT);
            } else if let Some(node) = nodes.get(child as usize) {
                prefetch_all_lines(node);
            }
        };
        for visit in &*waiting {
            is_waiting[visit.ray as usize & (STREAM_RAYS - 1)] = false;
        }
        let mut next = waiting.iter();
        // The first `count` are in use. Stacks stay where they are.
        let mut visits = [(Visit::default(), 0usize); TURNS];
        let mut places: [usize; TURNS] = std::array::from_fn(|i| i);
        let mut count = 0;
        while count < TURNS
            && let Some(&visit) = next.next()
        {
            prefetch(visitor, visit.child);
            visits[count] = (visit, 0);
            count += 1;
        }
        while count > 0 {
            let mut turn = 0;
            while turn < count {
                let (visit, top) = &mut visits[turn & (TURNS - 1)];
                let stack = &mut stacks[places[turn & (TURNS - 1)] & (TURNS - 1)];
                if step::<S, V>(nodes, visit, top, stack, prepared_rays, visitor) {
                    prefetch(visitor, visit.child);
                    turn += 1;
                } else if let Some(&new) = next.next() {
                    prefetch(visitor, new.child);
                    (*visit, *top) = (new, 0);
                    turn += 1;
                } else {
                    count -= 1;
                    visits.swap(turn & (TURNS - 1), count & (TURNS - 1));
                    places.swap(turn & (TURNS - 1), count & (TURNS - 1));
                }
            }
        }
        waiting.clear();
    }
}

/// Visits a node or a leaf, and finds the next one. Returns false if there is none.
#[inline(always)]
fn step<S: Simd, V: ListVisitor<S>>(
    nodes: &[Bvh8Node],
    visit: &mut Visit,
    top: &mut usize,
    stack: &mut TraversalStack,
    prepared_rays: &mut PreparedRays,
    visitor: &mut V,
) -> bool {
    let ray = visit.ray as usize & (STREAM_RAYS - 1);
    if visit.child & LEAF_BIT == 0 {
        let node = &nodes[visit.child as usize];
        let test_data = &prepared_rays.boxes[ray];
        let (enter, exit) = test_data.intervals::<S>(&NodePlanes::new(node, test_data.octant()));
        let (near, words) = stack.room(*top);
        if V::ANY_HIT {
            let hits = enter.le(exit);
            if hits != 0 {
                let remaining = hits & (hits - 1);
                words[0] = visit.child;
                words[1] = remaining;
                *top += if remaining == 0 { 0 } else { 2 };
                visit.child = node.child[hits.trailing_zeros() as usize & (WIDTH - 1)];
                return true;
            }
        } else {
            let octant = Octant::from_number(test_data.octant());
            let orders = [node.order(octant), node.order(octant.opposite())];
            let hit = S::compress_intersected(enter, exit, orders, &node.child, near, words);
            if hit.count > 0 {
                *top += hit.count - 1;
                visit.child = hit.last;
                return true;
            }
        }
    } else {
        visitor.visit_leaf(visit.child & !LEAF_BIT, &[visit.ray], prepared_rays);
        if V::ANY_HIT && prepared_rays.has_ended(ray) {
            return false;
        }
    }
    if V::ANY_HIT {
        let Some([node, remaining]) = stack.last_two(*top) else { return false };
        visit.child = nodes[*node as usize].child[remaining.trailing_zeros() as usize & (WIDTH - 1)];
        *remaining &= *remaining - 1;
        *top -= if *remaining == 0 { 2 } else { 0 };
        return true;
    }
    let limit = prepared_rays.boxes[ray].limit;
    while *top > 0 {
        *top -= 1;
        let Some((child, near)) = stack.child(*top) else { return false };
        if near <= limit {
            visit.child = child;
            return true;
        }
    }
    false
}
