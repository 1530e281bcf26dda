//! BVH traversal of a ray packet.

use crate::bvh::blas::Blas;
use crate::bvh::bvh8::{Bvh8Node, LEAF_BIT, Octant, SLOTS_IN_ORDER, SLOTS_REVERSED, WIDTH};
use crate::bvh::triangle4::Triangle4;
use crate::packet::group_bounds::{FarLimit, GroupBounds, ProjectedBox, ProjectedBoxes};
use crate::packet::packet_kind::PacketKind;
use crate::packet::packet_query::PacketQuery;
use crate::packet::per_ray::{GROUPS_PER_PACKET, RAYS_PER_GROUP, RayMask};
use crate::packet::ray_packet::RayPacket;
use blinn_core::simd::{Lanes, OutlinedKernel, Simd, prefetch_all_lines};

/// This many rays or fewer continue as single rays.
const MAX_RAYS_TO_CONTINUE_SINGLY: u32 = 3;

/// BVHs up to this many bytes are mostly in the processor's caches, where prefetching only costs time.
const CACHED_BVH_BYTES: usize = 8 << 20;

/// The nodes whose children a packet has yet to visit.
#[derive(Clone, Debug)]
pub(super) struct PacketStack {
    nodes: Vec<StackedNode>,
    /// Entries in use.
    len: usize,
}

/// A node and those of its children that are left to visit.
#[derive(Clone, Copy, Debug, Default)]
struct StackedNode {
    node: u32,
    /// Groups that may enter the children.
    groups: u32,
    /// Slots of the children, the next one to visit last.
    slots: [u32; WIDTH],
    /// Depths where the children begin, in the order of `slots`.
    near: [f32; WIDTH],
    /// Number of children that are left.
    remaining: u32,
    /// Bounds of the children on the projection plane, by axis and slot.
    min: [[f32; WIDTH]; 2],
    max: [[f32; WIDTH]; 2],
}

impl StackedNode {
    /// Returns the node's slot of child `i` in the order of visits.
    #[inline(always)]
    fn slot(&self, i: u32) -> usize {
        self.slots[i as usize & (WIDTH - 1)] as usize & (WIDTH - 1)
    }
}

impl Default for PacketStack {
    fn default() -> Self {
        PacketStack { nodes: vec![StackedNode::default(); 16], len: 0 }
    }
}

impl PacketStack {
    /// Returns the first unused entry.
    #[inline(always)]
    fn unused_entry(&mut self) -> &mut StackedNode {
        if self.len >= self.nodes.len() {
            self.grow();
        }
        &mut self.nodes[self.len]
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self) {
        self.nodes.resize(2 * (self.len + 1), StackedNode::default());
    }
}

/// A packet and its stack, reused for all packets of a batch.
#[derive(Debug, Default)]
pub(crate) struct PacketScratch {
    pub(super) packet: RayPacket,
    pub(super) stack: PacketStack,
}

/// Traces a packet through a BVH.
pub(super) struct TraversePacketKernel<'a, S: Simd, K, H> {
    pub packet: &'a mut RayPacket,
    pub blas: &'a Blas,
    pub kind: &'a K,
    pub bounds: &'a GroupBounds<S::F32x16>,
    /// The octant of the rays' mean direction.
    pub octant: Octant,
    pub hits: &'a mut H,
    pub stack: &'a mut PacketStack,
}

impl<S: Simd, K: PacketKind<S>, H: PacketQuery<S>> OutlinedKernel<S> for TraversePacketKernel<'_, S, K, H> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let TraversePacketKernel { packet, blas, kind, bounds, octant, hits, stack } = self;
        let Some(root) = blas.bvh.root else { return };
        let blocks: &[Triangle4] = &blas.blocks;
        stack.len = 0;
        let groups = packet.active_groups();
        if root & LEAF_BIT != 0 {
            packet.intersect_leaf::<S, K>(blocks, root & !LEAF_BIT, groups, kind, bounds, hits);
            return;
        }
        let nodes: &[Bvh8Node] = &blas.bvh.nodes;
        let by_occlusion_priority = hits.visits_by_occlusion_priority();
        let prefetches = size_of_val(nodes) + size_of_val(blocks) > CACHED_BVH_BYTES;
        let far_limit = bounds.far_limit::<S>(packet);
        let mut traversal = PacketTraversal::<S, K, H> {
            packet,
            nodes,
            blocks,
            kind,
            bounds,
            octant,
            by_occlusion_priority,
            prefetches,
            far_limit,
            hits,
            stack,
        };
        let mut next = Some(NodeVisit { node: root, groups });
        while let Some(visit) = next {
            traversal.push_children(visit);
            next = traversal.next_node();
        }
    }
}

/// A packet traversal under way.
struct PacketTraversal<'a, S: Simd, K, H> {
    packet: &'a mut RayPacket,
    nodes: &'a [Bvh8Node],
    blocks: &'a [Triangle4],
    kind: &'a K,
    bounds: &'a GroupBounds<S::F32x16>,
    octant: Octant,
    by_occlusion_priority: bool,
    prefetches: bool,
    far_limit: FarLimit<S::F32x16>,
    hits: &'a mut H,
    stack: &'a mut PacketStack,
}

/// A node and the groups that enter its box.
struct NodeVisit {
    node: u32,
    groups: u32,
}

/// A child of a node and the groups that may enter its box.
struct ChildVisit<'a> {
    parent: &'a Bvh8Node,
    slot: usize,
    /// The child's node index, or [`LEAF_BIT`] and its leaf number.
    child: u32,
    bounds: ProjectedBox,
    groups: u32,
}

/// The rays that enter a box.
struct EnteringRays {
    /// Set for groups whose rays were tested one by one.
    rays: RayMask,
    /// Groups with an entering ray.
    groups: u32,
    /// Number of rays. Groups that were not tested ray by ray count as full.
    count: u32,
}

impl<'a, S: Simd, K: PacketKind<S>, H: PacketQuery<S>> PacketTraversal<'a, S, K, H> {
    /// Pushes the children of a node that any ray may enter.
    #[inline(always)]
    fn push_children(&mut self, NodeVisit { node: index, groups }: NodeVisit) {
        let node = &self.nodes[index as usize];
        let boxes: ProjectedBoxes<S::F32x8> = self.kind.project_children(node);
        let children = self.bounds.hit_children(&boxes, &self.far_limit) & node.child_mask();
        if children == 0 {
            return;
        }
        let entry = self.stack.unused_entry();
        entry.node = index;
        entry.groups = groups;
        entry.remaining = children.count_ones();
        let order = if self.by_occlusion_priority { SLOTS_REVERSED } else { node.order(self.octant) };
        S::permute_compress(children, order, boxes.near, &SLOTS_IN_ORDER, &mut entry.near, &mut entry.slots);
        for axis in 0..2 {
            boxes.min[axis].store(&mut entry.min[axis]);
            boxes.max[axis].store(&mut entry.max[axis]);
        }
        self.stack.len += 1;
    }

    /// Pops children until one is an inner node that rays enter as a packet: intersects leaves and traces single rays
    /// on the way. Returns `None` at the end of the traversal.
    #[inline(always)]
    fn next_node(&mut self) -> Option<NodeVisit> {
        loop {
            let visit = self.next_child()?;
            let is_leaf = visit.child & LEAF_BIT != 0;
            let mut groups = visit.groups;
            let mut groups_by_ray = groups;
            if !is_leaf {
                groups_by_ray &= self.bounds.groups_larger_than(&visit.bounds);
            }
            if groups_by_ray != 0 {
                let entering = self.intersect_box(&visit, groups_by_ray);
                groups = entering.groups;
                if groups == 0 {
                    continue;
                }
                if entering.count <= MAX_RAYS_TO_CONTINUE_SINGLY && !is_leaf {
                    let changed = self.trace_single_rays(visit.child, &entering);
                    if self.update_far_limit(changed) {
                        return None;
                    }
                    continue;
                }
            }
            if !is_leaf {
                return Some(NodeVisit { node: visit.child, groups });
            }
            let changed = self.packet.intersect_leaf::<S, K>(
                self.blocks,
                visit.child & !LEAF_BIT,
                groups,
                self.kind,
                self.bounds,
                self.hits,
            );
            if self.update_far_limit(changed) {
                return None;
            }
        }
    }

    /// Pops the next child that any group may enter.
    #[inline(always)]
    fn next_child(&mut self) -> Option<ChildVisit<'a>> {
        loop {
            let entry = self.stack.nodes[..self.stack.len].last_mut()?;
            if entry.remaining == 0 {
                self.stack.len -= 1;
                continue;
            }
            entry.remaining -= 1;
            let slot = entry.slot(entry.remaining);
            let bounds = ProjectedBox {
                min: [entry.min[0][slot], entry.min[1][slot]],
                max: [entry.max[0][slot], entry.max[1][slot]],
                near: entry.near[entry.remaining as usize & (WIDTH - 1)],
            };
            let groups = entry.groups & self.bounds.hit_groups(&bounds, &self.far_limit);
            if groups == 0 {
                continue;
            }
            let parent = &self.nodes[entry.node as usize];
            if self.prefetches && entry.remaining > 0 {
                // The child to visit after this one, unless this one is an inner node.
                let next_slot = entry.slot(entry.remaining - 1);
                prefetch_child(parent.child[next_slot], self.nodes, self.blocks);
            }
            return Some(ChildVisit { parent, slot, child: parent.child[slot], bounds, groups });
        }
    }

    /// Tests the rays of `groups_by_ray` against a child's box one by one. Its other groups enter it.
    #[inline(always)]
    fn intersect_box(&self, visit: &ChildVisit, mut groups_by_ray: u32) -> EnteringRays {
        let planes = self.kind.box_planes(visit.parent, visit.slot);
        let mut entering = EnteringRays {
            rays: [0; GROUPS_PER_PACKET],
            groups: visit.groups,
            count: (visit.groups & !groups_by_ray).count_ones() * RAYS_PER_GROUP as u32,
        };
        while groups_by_ray != 0 {
            let g = groups_by_ray.trailing_zeros() as usize % GROUPS_PER_PACKET;
            groups_by_ray &= groups_by_ray - 1;
            let rays = self.kind.intersect_box(self.packet, g, &planes) & self.packet.active[g];
            entering.rays[g] = rays;
            entering.count += rays.count_ones();
            entering.groups &= !(u32::from(rays == 0) << g);
        }
        entering
    }

    /// Traces the entering rays below a child as single rays. Returns the groups with hits.
    #[inline(always)]
    fn trace_single_rays(&mut self, child: u32, entering: &EnteringRays) -> u32 {
        let mut changed = 0;
        let mut groups = entering.groups;
        while groups != 0 {
            let g = groups.trailing_zeros() as usize % GROUPS_PER_PACKET;
            groups &= groups - 1;
            let mut rays = entering.rays[g];
            while rays != 0 {
                let ray = g * RAYS_PER_GROUP + rays.trailing_zeros() as usize;
                changed |= u32::from(self.hits.trace_single(self.packet, ray, child)) << g;
                rays &= rays - 1;
            }
        }
        changed
    }

    /// Updates the far limit after hits in some groups. Returns true if no active ray is left.
    #[inline(always)]
    fn update_far_limit(&mut self, changed_groups: u32) -> bool {
        if changed_groups == 0 {
            return false;
        }
        self.bounds.update_far_limit::<S>(self.packet, changed_groups, &mut self.far_limit);
        self.packet.active == [0; GROUPS_PER_PACKET]
    }
}

/// Prefetches a child of a node: an inner node, or the first block of a leaf.
#[inline(always)]
fn prefetch_child(child: u32, nodes: &[Bvh8Node], blocks: &[Triangle4]) {
    if child & LEAF_BIT == 0 {
        nodes.get(child as usize).into_iter().for_each(prefetch_all_lines);
    } else {
        blocks.get((child & !LEAF_BIT) as usize).into_iter().for_each(prefetch_all_lines);
    }
}
