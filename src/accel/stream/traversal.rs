//! Traversal of a BVH by a stream of rays.

use crate::bvh::bvh8::{Bvh8, Bvh8Node, LEAF_BIT, OCTANTS, Octant, WIDTH};
use crate::stream::list_visitor::ListVisitor;
use crate::stream::lists::ListStack;
use crate::stream::node_test::test_boxes;
use crate::stream::prepared_rays::PreparedRays;
use crate::stream::short_lists::ShortLists;
use blinn_core::simd::{OutlinedKernel, Simd};

/// Rays of lists that are no longer than this go on one by one.
const SHORT_LIST: usize = 4;

/// The rays of a stream in the frame of a BVH, and memory to traverse it.
#[derive(Debug, Default)]
pub(super) struct TraversalScratch {
    pub prepared_rays: PreparedRays,
    lists: ListStack,
    short: ShortLists,
    /// The rays of the stream by octant.
    by_octant: Vec<u32>,
}

/// Traces the first `count` rays of `scratch` through a BVH below `root`, except for those without an octant.
pub(super) struct TraverseKernel<'a, V> {
    pub bvh: &'a Bvh8,
    pub root: u32,
    pub count: usize,
    pub scratch: &'a mut TraversalScratch,
    pub visitor: &'a mut V,
}

impl<S: Simd, V: ListVisitor<S>> OutlinedKernel<S> for TraverseKernel<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let TraverseKernel { bvh, root, count, scratch, visitor } = self;
        let TraversalScratch { prepared_rays, lists, short, by_octant } = scratch;
        let ends = sort_by_octant(&prepared_rays.octants[..count], by_octant);
        let mut first = 0;
        for (octant, end) in ends.into_iter().enumerate().take(OCTANTS) {
            // Any hits are found by one stream for all octants.
            let is_last = octant == OCTANTS - 1;
            if (V::ANY_HIT && !is_last) || first == end {
                continue;
            }
            lists.start(root, &by_octant[first..end]);
            let mut traversal =
                Traversal { bvh, prepared_rays: &mut *prepared_rays, lists: &mut *lists, short: &mut *short };
            traversal.run::<S, V>(octant, visitor);
            first = end;
        }
    }
}

/// A stream on its way through a BVH.
struct Traversal<'a> {
    bvh: &'a Bvh8,
    prepared_rays: &'a mut PreparedRays,
    lists: &'a mut ListStack,
    short: &'a mut ShortLists,
}

impl Traversal<'_> {
    /// Traces the rays of the list that the stack starts with. Those for closest hits are all of one octant.
    #[inline(always)]
    fn run<S: Simd, V: ListVisitor<S>>(&mut self, octant: usize, visitor: &mut V) {
        let nodes: &[Bvh8Node] = &self.bvh.nodes;
        while let Some(list) = self.lists.pop() {
            if list.len() <= SHORT_LIST {
                for &ray in self.lists.rays(list) {
                    // A ray visits what is near first.
                    if !V::ANY_HIT && self.short.is_waiting(ray) {
                        self.short.trace_all::<S, V>(self.bvh, self.prepared_rays, visitor);
                    }
                    if !V::ANY_HIT || !self.prepared_rays.has_ended(ray as usize) {
                        self.short.push(ray, list.child);
                    }
                }
                if self.short.is_full() {
                    self.short.trace_all::<S, V>(self.bvh, self.prepared_rays, visitor);
                }
            } else if list.child & LEAF_BIT != 0 {
                visitor.visit_leaf(list.child & !LEAF_BIT, self.lists.rays(list), self.prepared_rays);
            } else {
                let node = &nodes[list.child as usize];
                let (rays, masks) = self.lists.rays_and_masks(list);
                let count = node.count();
                test_boxes::<S>(node, &self.prepared_rays.boxes, rays, masks);
                if V::ANY_HIT {
                    self.lists.push_children::<S>(list, node, (0..count).rev());
                } else {
                    let octant = Octant::from_number(octant);
                    let slots = (0..count.min(WIDTH)).map(|nth| node.nth_slot(octant, nth));
                    self.lists.push_children::<S>(list, node, slots);
                }
            }
        }
        self.short.trace_all::<S, V>(self.bvh, self.prepared_rays, visitor);
    }
}

/// Sorts the rays with an octant by it. Returns where each octant ends.
#[inline(always)]
fn sort_by_octant(octants: &[u8], sorted: &mut Vec<u32>) -> [usize; OCTANTS] {
    let mut next = [0; 2 * OCTANTS];
    for &octant in octants {
        next[usize::from(octant) % (2 * OCTANTS)] += 1;
    }
    let mut end = 0;
    for next in &mut next {
        end += *next;
        *next = end - *next;
    }
    sorted.clear();
    sorted.resize(octants.len(), 0);
    for (ray, &octant) in octants.iter().enumerate() {
        let place = &mut next[usize::from(octant) % (2 * OCTANTS)];
        sorted[*place] = ray as u32;
        *place += 1;
    }
    std::array::from_fn(|octant| next[octant])
}
